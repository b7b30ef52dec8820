"""Attempts: what an expert does from one start to success or to a limit."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import dm_env
import numpy as np

from lfgp_dmc import seeding
from lfgp_dmc.acting import environments
from lfgp_dmc.acting.environments import has_succeeded, is_physics_failure
from lfgp_dmc.types import Actor

LIMIT = 90  # steps of an attempt at 20 Hz (the released code's)
# Unstack-Stack's is the authors' later setting. Ours: Bring's expert may first
# have to take green out of blue's zone (a quarter of the starts), Insert's to
# turn blue square and to try again.
LIMITS = {"unstack_stack": 120, "bring": 150, "insert": 240}

OPEN, CLOSE, LIFT = "open_gripper", "close_gripper", "lift"
OPEN_LEAD = 45  # steps of another task before Open-Gripper, not stored
CLOSE_LEAD = 15  # steps of Lift before Close-Gripper, stored
MAIN_LEAD_SHARE = 0.25  # of Open-Gripper's leads that are the main task


# A task and the numbers of its reset-based attempts; or None and the numbers of
# play-based stretches between two resets.
Job = tuple[str | None, Sequence[int]]


@dataclass(frozen=True)
class Plan:
  """What is collected, how; picklable.

  Attributes:
    make_environment: task -> its environment, with `reseed`, `clear_success`
      and the observables `success/<task>`.
    make_actor: the expert.
    main_task: whose T_all it is.
    tasks: T_all, the main task first.
    seed: everything random follows from it.
    control_hz: control steps a second.
    play_steps: steps at 20 Hz between resets in play-based collection.
    limits: task -> most steps at 20 Hz of an attempt, where not `LIMIT`.
    longest_of: of so many reset-based attempts the longest is kept, so that
      the starts that take more doing are shown more often.
  """

  make_environment: Callable[[str], dm_env.Environment]
  make_actor: Callable[[], Actor]
  main_task: str
  tasks: tuple[str, ...]
  seed: int
  control_hz: int = 20
  play_steps: int = 360
  limits: Mapping[str, int] = field(default_factory=lambda: LIMITS)
  longest_of: int = 1

  def steps(self, at_20_hz: int) -> int:
    """The same time in control steps, rounded up."""
    return math.ceil(at_20_hz * self.control_hz / 20)

  def limit(self, task: str) -> int:
    """Most control steps of an attempt.

    Experts take longer at lower rates; without more time the hard starts would
    be missing from the data.
    """
    at_20_hz = self.limits.get(task, LIMIT)
    return self.steps(at_20_hz if self.control_hz >= 20 else 2 * at_20_hz)


class Rows(NamedTuple):
  """The T steps of a successful attempt."""

  observation: np.ndarray  # float32 [T, O]
  action: np.ndarray  # float32 [T, A]
  next_observation: np.ndarray  # float32 [T, O]


class Attempt(NamedTuple):
  """A finished attempt; `rows` is None unless it succeeded."""

  task: str
  rows: Rows | None


class Collector:
  """Makes attempts; each depends on the plan and its number alone."""

  def __init__(self, plan: Plan):
    """Builds the actor; environments are built when first needed."""
    self._plan = plan
    self._actor = plan.make_actor()
    self._environments: dict[str, Any] = {}
    self._environment: Any = None

  def __call__(self, job: Job) -> tuple[str | None, list[Attempt]]:
    """Makes the attempts of a job; returns its task and them, in order."""
    task, numbers = job
    if task is None:
      return task, [attempt for i in numbers for attempt in self._play(i)]
    return task, [self._longest(task, i) for i in numbers]

  def _longest(self, task: str, number: int) -> Attempt:
    """The longest successful one of the plan's so many; or a failed one."""
    count = self._plan.longest_of
    made = [
      self._attempt_from_reset(task, count * number + i) for i in range(count)
    ]
    return max(made, key=lambda a: 0 if a.rows is None else len(a.rows.action))

  def _attempt_from_reset(self, task: str, number: int) -> Attempt:
    """Resets, takes the lead of Open- or Close-Gripper, then tries."""
    plan = self._plan
    seed = seeding.derive(plan.seed, "collect", task, number)
    lead = self._lead(task, seeding.generator(seed, "lead"))
    # A task starts as its own environment starts, so that its data can be
    # used with every main task; only a lead by the main task is its own.
    self._load(plan.main_task if lead == plan.main_task else task)
    self._environment.reseed(seed)
    timestep = self._environment.reset()
    before = _Steps()
    if lead is not None:
      steps = plan.steps(OPEN_LEAD if task == OPEN else CLOSE_LEAD)
      self._actor.begin(lead, seeding.derive(seed, "lead actor"))
      timestep, _ = self._run(timestep, lead, steps, before, stop=False)
      if timestep.last():
        return Attempt(task, None)
      self._environment.clear_success()
    stored = before if task == CLOSE else _Steps()
    self._actor.begin(task, seeding.derive(seed, "actor"))
    timestep, success = self._run(timestep, task, plan.limit(task), stored)
    return Attempt(task, stored.rows() if success else None)

  def _lead(self, task: str, random: np.random.Generator) -> str | None:
    """Which task comes first; None: no other is there to come first."""
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

    There are no leads: what came before is what a lead imitates. The attempt
    that the reset interrupts counts for nothing.
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
      steps = _Steps()
      limit = plan.limit(task)
      timestep, success = self._run(timestep, task, min(limit, left), steps)
      left -= len(steps)
      if success:
        attempts.append(Attempt(task, steps.rows()))
      elif len(steps) == limit:
        attempts.append(Attempt(task, None))
    return attempts

  def _run(self, timestep, task: str, limit: int, steps: "_Steps", stop=True):
    """Steps until success (if `stop`), the limit or the episode's end.

    Returns:
      The last timestep, and whether the task has succeeded.
    """
    observation = self._flatten(timestep.observation)
    success = False
    for _ in range(limit):
      action = np.asarray(self._actor.act(observation), np.float32)
      timestep = self._environment.step(action)
      if is_physics_failure(timestep):
        return timestep, False
      following = self._flatten(timestep.observation)
      steps.add(observation, action, following)
      observation = following
      success = stop and bool(has_succeeded(timestep, task))
      if success or timestep.last():
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
    self._flatten = environments.flattener(self._environment)


class _Steps:
  """Collects steps; `rows` stacks them."""

  def __init__(self):
    self._steps: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

  def __len__(self) -> int:
    return len(self._steps)

  def add(
    self,
    observation: np.ndarray,
    action: np.ndarray,
    next_observation: np.ndarray,
  ) -> None:
    """Adds a step."""
    self._steps.append((observation, action, next_observation))

  def rows(self) -> Rows:
    """All steps, stacked."""
    return Rows(*(np.stack(part) for part in zip(*self._steps, strict=True)))
