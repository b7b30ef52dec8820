"""Acting in a process of its own, while this one learns.

The learner asks for one period at a time (some steps of one intention) with
the weights that the actor is to use, and learns from a period while the next is
played. What is asked for, and when, depends on counts alone, never on which
process is faster: the same seed gives the same numbers here too.
"""

import contextlib
import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection
from typing import NamedTuple

import dm_env
import numpy as np

from lfgp_dmc import seeding
from lfgp_dmc.acting import environments, workers
from lfgp_dmc.types import Actor, Agent, Step, Transition

MakeActor = Callable[[Mapping[str, np.ndarray]], Actor]


class _Request(NamedTuple):
  """What the actor is to do next."""

  episode_seed: int | None  # not None: reset first, to this seed's start
  task: str
  steps: int
  random_steps: int
  seed: int  # of actions
  arrays: dict[str, np.ndarray]  # the policy's


class RemoteActor:
  """The learner's end: a stream of steps, one period ahead of the learner."""

  def __init__(
    self,
    make_environment: Callable[[], dm_env.Environment],
    make_actor: MakeActor,
    reward_tasks: Sequence[str] = (),
  ):
    """Starts the process.

    Args:
      make_environment: importable; builds the world to act in.
      make_actor: importable; builds a sampling actor of `policy_arrays`.
      reward_tasks: whose rewards each step brings along; none: no rewards.
    """
    context = multiprocessing.get_context("spawn")
    self._pipe, theirs = context.Pipe()
    arguments = (make_environment, make_actor, tuple(reward_tasks), theirs)
    with workers.variables():
      self._process = context.Process(
        target=_serve, args=arguments, daemon=True
      )
      self._process.start()
    theirs.close()

  def episode(
    self, agent: Agent, seed: int, env_step: int, most: int
  ) -> Iterator[Step]:
    """Plays one episode.

    Args:
      agent: chooses what is played, and with which weights.
      seed: of its start and its actions.
      env_step: steps of the run before it.
      most: steps at most.

    Yields:
      The steps, in order, to the episode's end or `most`.

    Raises:
      RuntimeError: the actor's process failed; it told why.
    """
    agent.begin_episode()
    asked = self._ask(agent, seed, env_step, most, is_first=True)
    while asked:
      try:
        played: list[Step] = self._pipe.recv()
      except (EOFError, OSError):
        raise RuntimeError("the process that acts failed") from None
      done = asked
      if played[-1].is_last:
        asked = 0
      else:
        most -= done
        env_step += done
        asked = self._ask(agent, seed, env_step, most, is_first=False)
      yield from played

  def close(self) -> None:
    """Ends the process."""
    with contextlib.suppress(OSError):
      self._pipe.send(None)
    self._pipe.close()
    self._process.join()

  def _ask(
    self, agent: Agent, seed: int, env_step: int, most: int, is_first: bool
  ) -> int:
    """Asks for the next period; returns its steps, 0 if none are left."""
    if most <= 0:
      return 0
    period = agent.next_period(env_step)
    steps = min(period.steps, most)
    request = _Request(
      seed if is_first else None,
      period.task,
      steps,
      period.random_steps,
      seeding.derive(seed, "acting", env_step),
      agent.policy_arrays(),
    )
    with contextlib.suppress(OSError):  # a dead process shows when we read
      self._pipe.send(request)
    return steps


def _serve(
  make_environment: Callable[[], dm_env.Environment],
  make_actor: MakeActor,
  reward_tasks: tuple[str, ...],
  pipe: Connection,
) -> None:
  """What the actor's process does."""
  workers.settle_in()
  environment = make_environment()
  flatten = environments.flattener(environment)
  timestep = None
  with contextlib.suppress(EOFError):
    while (request := pipe.recv()) is not None:
      if request.episode_seed is not None:
        if hasattr(environment, "reseed"):
          environment.reseed(request.episode_seed)
        timestep = environment.reset()
      assert timestep is not None, "the first request of an episode resets"
      played, timestep = _play(
        environment, make_actor, request, timestep, flatten, reward_tasks
      )
      pipe.send(played)
  environment.close()


def _play(
  environment, make_actor, request, timestep, flatten, reward_tasks
) -> tuple[list[Step], dm_env.TimeStep]:
  """One period, and the time step after it."""
  actor = make_actor(request.arrays)
  actor.begin(request.task, request.seed)
  random = seeding.generator(request.seed, "random actions")
  observation = flatten(timestep.observation)
  played: list[Step] = []
  while len(played) < request.steps and not timestep.last():
    action = actor.act(observation)
    if len(played) < request.random_steps:
      action = random.uniform(-1, 1, action.shape).astype(np.float32)
    timestep = environment.step(action)
    reached = flatten(timestep.observation)
    rewards = None
    if reward_tasks:
      rewards = environments.task_rewards(timestep, reward_tasks)
    played.append(
      Step(
        Transition(observation, action, reached),
        rewards,
        timestep.last(),
        environments.is_physics_failure(timestep),
      )
    )
    observation = reached
  return played, timestep
