"""Who acts when: one intention, play from task to task, or the scheduler."""

import itertools
from collections.abc import Sequence

import dm_env
import numpy as np

import lfgp_dmc
from lfgp_dmc import seeding
from lfgp_dmc.acting import environments
from lfgp_dmc.launch import policies
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.pictures.recorder import Switch
from lfgp_dmc.runs import checkpoints, run_folder

SCHEDULED = "scheduled"
_PLAY_PATIENCE = 120  # control steps an attempt of play-based collection


def make_switch(
  cast: policies.Cast,
  task: str,
  is_play: bool,
  environment: dm_env.Environment,
  seed: int,
) -> Switch:
  """What chooses the acting task at each control step.

  Args:
    cast: the actor.
    task: an intention, or `SCHEDULED`.
    is_play: another random task after each success, without a reset.
    environment: play clears its successes.
    seed: of the choices.

  Raises:
    UserError: there is no scheduler to go by.
  """
  if is_play:
    return _Play(environment, cast.main_task, seed)
  if task == SCHEDULED:
    return _scheduled(cast, seed)
  return lambda step, timestep: task


def spans(labels: Sequence[str], every: float) -> list[dict[str, int | str]]:
  """Who acted from which control step on; `every`: control steps a frame."""
  starts: list[dict[str, int | str]] = []
  frames = 0
  for label, group in itertools.groupby(labels):
    starts.append({"from_step": int(every * frames), "intention": label})
    frames += len(list(group))
  return starts


def cameras(environment: dm_env.Environment) -> tuple[str, ...]:
  """Names of the cameras.

  Raises:
    UserError: not a MuJoCo environment.
  """
  physics = getattr(environment, "physics", None)
  if physics is None:
    raise UserError("this environment has no physics to render")
  return tuple(
    physics.model.id2name(i, "camera") for i in range(physics.model.ncam)
  )


class _Play:
  """The next random task after each success, or when patience ends."""

  def __init__(self, environment, main_task: str, seed: int):
    self._environment = environment
    self._tasks = lfgp_dmc.task_set(main_task)
    self._random = seeding.generator(seed, "play")
    self._next(0)

  def __call__(self, step: int, timestep: dm_env.TimeStep) -> str:
    is_done = environments.has_succeeded(timestep, self._task)
    if is_done or step - self._since >= _PLAY_PATIENCE:
      self._environment.clear_success()
      self._next(step)
    return self._task

  def _next(self, step: int) -> None:
    others = [t for t in self._tasks if t != getattr(self, "_task", None)]
    self._task = others[self._random.integers(len(others))]
    self._since = step


def _scheduled(cast: policies.Cast, seed: int) -> Switch:
  """The run's own scheduler, with what it had learned by its last checkpoint.

  Raises:
    UserError: a policy folder has no scheduler.
  """
  if cast.folder is None or "agent" not in cast.config:
    raise UserError("--task=scheduled needs the folder of a whole run")
  from lfgp_dmc.agents.schedulers import make_scheduler
  from lfgp_dmc.launch import configs

  stored = {
    name: value
    for name, value in cast.config.items()
    if name not in run_folder.ADDED_FIELDS
  }
  try:
    agent = configs.from_dict(stored).agent
    periods = -(-agent.episode_steps // agent.xi)
    scheduler = make_scheduler(
      agent, cast.tasks, 0, periods, np.random.default_rng(seed)
    )
  except ValueError as error:
    raise UserError(f"{cast.folder}: {error}") from None
  path = checkpoints.latest(run_folder.RunFolder(cast.folder).checkpoints)
  if path is not None:
    state = checkpoints.load(path)["agent"]["scheduler"]
    scheduler.load_state_dict(state)
  scheduler.begin_episode()
  chosen = ""

  def choose(step: int, timestep: dm_env.TimeStep) -> str:
    nonlocal chosen
    if step % agent.xi == 0:
      chosen = cast.tasks[scheduler.next_task()]
    return chosen

  return choose
