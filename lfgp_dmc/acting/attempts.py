"""Attempts: an expert at one task, until it succeeds or reaches a limit."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import dm_env
import numpy as np

from lfgp_dmc import observations, seeding
from lfgp_dmc.acting import rollout
from lfgp_dmc.acting.environments import has_succeeded, is_physics_failure
from lfgp_dmc.types import Actor, Step, Transition

EPISODE = 360  # steps of the block tasks' at 20 Hz
LIMIT = 90  # steps of an attempt at 20 Hz (the released code's)
# Unstack-Stack's is the authors' later setting. The others are ours: Bring's
# expert may have to take green out of blue's zone first (a quarter of the
# starts), Insert's to turn blue square and to try again.
LIMITS = {"unstack_stack": 120, "bring": 150, "insert": 240}

OPEN, CLOSE, LIFT = "open_gripper", "close_gripper", "lift"
OPEN_LEAD = 45  # steps of another task before Open-Gripper, not stored
CLOSE_LEAD = 15  # steps of Lift before Close-Gripper, stored
MAIN_LEAD_SHARE = 0.25  # of Open-Gripper's leads: the main task


# A task and the numbers of its reset-based attempts, or None and the numbers of
# play-based stretches between two resets.
Job = tuple[str | None, Sequence[int]]


@dataclass(frozen=True)
class CollectionPlan:
  """What is collected, and how; picklable."""

  # Task -> its environment, with `reseed`, `clear_success` and the observables
  # `success/<task>`.
  make_environment: Callable[[str], dm_env.Environment]
  make_actor: Callable[[], Actor]  # the expert
  main_task: str
  tasks: tuple[str, ...]  # T_all, the main task first
  seed: int  # everything random follows from it
  control_hz: int = 20
  play_steps: int = EPISODE  # at 20 Hz, between resets in play-based collection
  limits: Mapping[str, int] = field(default_factory=lambda: LIMITS)
  # Keep the longest of this many reset-based attempts: more hard starts.
  keep_longest_of: int = 1
  # [C, H, W, 3], if pairs consist of what a robot senses and of frames.
  frame_shape: tuple[int, ...] = ()

  def steps(self, at_20_hz: int) -> int:
    """Control steps of as much time, rounded up."""
    return math.ceil(at_20_hz * self.control_hz / 20)

  def limit(self, task: str) -> int:
    """Most control steps of an attempt; twice the time at lower rates.

    Experts take longer there, and hard starts must not be missing. No attempt
    is longer than an episode.
    """
    at_20_hz = self.limits.get(task, LIMIT)
    if self.control_hz < 20:
      at_20_hz = min(2 * at_20_hz, EPISODE)
    return self.steps(at_20_hz)


class Attempt(NamedTuple):
  """A finished attempt."""

  task: str
  rows: Transition | None  # arrays [T, ...]; None unless it succeeded
  frames: np.ndarray | None = None  # uint8 [T + 1, C, H, W, 3]


class Collector:
  """Makes attempts; each depends on the plan and its number alone."""

  def __init__(self, plan: CollectionPlan):
    """Builds the actor; environments are built when first needed."""
    self._plan = plan
    self._actor = plan.make_actor()
    self._environments: dict[str, Any] = {}
    self._environment: Any = None

  def close(self) -> None:
    """Frees the environments."""
    for environment in self._environments.values():
      environment.close()

  def __call__(self, job: Job) -> tuple[str | None, list[Attempt]]:
    """Makes the attempts of a job, in order; returns them with its task."""
    task, numbers = job
    if task is None:
      return task, [attempt for i in numbers for attempt in self._play(i)]
    return task, [self._longest(task, i) for i in numbers]

  def _longest(self, task: str, number: int) -> Attempt:
    """The longest success of `keep_longest_of` attempts, or a failure."""
    count = self._plan.keep_longest_of
    made = [
      self._attempt_from_reset(task, count * number + i) for i in range(count)
    ]
    return max(made, key=lambda a: 0 if a.rows is None else len(a.rows.action))

  def _attempt_from_reset(self, task: str, number: int) -> Attempt:
    """Resets, plays the lead of Open- or Close-Gripper, then the task."""
    plan = self._plan
    seed = seeding.derive(plan.seed, "collect", task, number)
    lead = self._lead(task, seeding.generator(seed, "lead"))
    # A task starts as in its own environment, so that its data fit every main
    # task; only a lead by the main task does not.
    self._load(plan.main_task if lead == plan.main_task else task)
    self._environment.reseed(seed)
    timestep = self._environment.reset()
    before: list[Transition] = []
    if lead is not None:
      steps = plan.steps(OPEN_LEAD if task == OPEN else CLOSE_LEAD)
      self._actor.begin(lead, seeding.derive(seed, "lead actor"))
      timestep, _ = self._run(timestep, lead, steps, before, stop=False)
      if timestep.last():
        return Attempt(task, None)
      self._environment.clear_success()
    stored = before if task == CLOSE else []
    self._actor.begin(task, seeding.derive(seed, "actor"))
    timestep, success = self._run(timestep, task, plan.limit(task), stored)
    return self._stacked(task, stored) if success else Attempt(task, None)

  def _lead(self, task: str, random: np.random.Generator) -> str | None:
    """The task that is played first, if any."""
    plan = self._plan
    if task == CLOSE and LIFT in plan.tasks:
      return LIFT
    others = [name for name in plan.tasks if name != task]
    if task != OPEN or not others:
      return None
    if plan.main_task not in others or len(others) == 1:
      return str(random.choice(others))
    share = (1.0 - MAIN_LEAD_SHARE) / (len(others) - 1)
    weights = [
      MAIN_LEAD_SHARE if name == plan.main_task else share for name in others
    ]
    return str(random.choice(others, p=weights))

  def _play(self, number: int) -> list[Attempt]:
    """Random tasks one after the other, until the next reset is due.

    There are no leads: they imitate the task before. The attempt that the reset
    interrupts does not count.
    """
    plan = self._plan
    self._load(plan.main_task)
    seed = seeding.derive(plan.seed, "collect", "play", number)
    random = seeding.generator(seed, "tasks")
    self._environment.reseed(seed)
    timestep = self._environment.reset()
    attempts: list[Attempt] = []
    left = plan.steps(plan.play_steps)
    while left and not timestep.last():
      task = str(random.choice(plan.tasks))
      self._environment.clear_success()
      self._actor.begin(task, seeding.derive(seed, "actor", len(attempts)))
      steps: list[Transition] = []
      limit = plan.limit(task)
      timestep, success = self._run(timestep, task, min(limit, left), steps)
      left -= len(steps)
      if success:
        attempts.append(self._stacked(task, steps))
      elif len(steps) == limit:
        attempts.append(Attempt(task, None))
    return attempts

  def _run(
    self,
    timestep: dm_env.TimeStep,
    task: str,
    limit: int,
    stored: list[Transition],
    stop: bool = True,
  ) -> tuple[dm_env.TimeStep, bool]:
    """Steps until success (if `stop`), the limit or the episode's end.

    Returns the last timestep, and whether the task has succeeded.
    """
    success = False
    played = rollout.steps(self._environment, timestep, self._actor.act)
    for step in itertools.islice(played, limit):
      before, timestep = timestep, step.timestep
      if is_physics_failure(timestep):
        return timestep, False
      stored.append(self._seen(before, step))
      success = stop and bool(has_succeeded(timestep, task))
      if success:
        break
    return timestep, success

  def _load(self, task: str) -> None:
    """Takes the task's environment; keeps it and the main task's."""
    if task not in self._environments:
      for other in [*self._environments]:
        if other != self._plan.main_task:
          self._environments.pop(other).close()
      self._environments[task] = self._plan.make_environment(task)
    self._environment = self._environments[task]

  def _seen(self, before: dm_env.TimeStep, step: Step) -> Transition:
    """What is stored of a step: the expert may have seen more than a robot."""
    seen = step.timestep.observation
    if not (self._plan.frame_shape and observations.has_state(seen)):
      return step.transition
    first, second = map(observations.flatten_vision, (before.observation, seen))
    return Transition(first, step.transition.action, second)

  def _stacked(self, task: str, steps: Sequence[Transition]) -> Attempt:
    """The success; frames, of which neighbours share one, apart."""
    observed, actions, after = zip(*steps, strict=True)
    action, shape = np.stack(actions), self._plan.frame_shape
    if not shape:
      return Attempt(
        task, Transition(np.stack(observed), action, np.stack(after))
      )
    states = np.stack([*observed, after[-1]])  # [T + 1, ...]
    floats = states.shape[1] - math.prod(shape)
    own = states[:, :floats].copy()  # no view: the pixels are to go
    frames = states[:, floats:].astype(np.uint8).reshape(-1, *shape)
    return Attempt(task, Transition(own[:-1], action, own[1:]), frames)
