"""Shared types, and the legend of every shape in the project.

Shapes are written `[B, K, A]`:
  B: batch rows.                 K: tasks, in the order of `task_set`.
  A: action dimensions (4).      O: observation dimensions (59).
  N: stored pairs or rows.       H: hidden units.
  T: control steps.              W: environments side by side.

Units are SI (m, m/s, rad/s, N, N m); quaternions are w x y z.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import dm_env
import numpy as np

Metrics = dict[str, float]
EnvironmentFactory = Callable[[], dm_env.Environment]


class Transition(NamedTuple):
  """One step as the replay stores it: raw, no reward baked in."""

  observation: np.ndarray  # float32 [O]
  action: np.ndarray  # float32 [A]
  next_observation: np.ndarray  # float32 [O]


class Step(NamedTuple):
  """One step of an episode as the training loop gets it."""

  transition: Transition
  rewards: np.ndarray | None  # float32 [R] if the replay keeps them
  is_last: bool
  is_physics_failure: bool


class Period(NamedTuple):
  """What a scheduler chose: some steps of one intention."""

  task: str
  steps: int
  random_steps: int  # the first so many take actions from U[-1, 1]


class Actor(Protocol):
  """Plays one task at a time: a scripted expert or a learned intention."""

  def begin(self, task: str, seed: int) -> None:
    """Starts an attempt at `task`; all randomness follows from `seed`."""

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Maps one flat observation, float32 [O], to an action, float32 [A]."""


class Agent(Protocol):
  """A learner as the training loop sees it; see `lfgp_dmc/runs/loop.py`."""

  tasks: tuple[str, ...]

  def prepare(self, progress_bar: bool) -> None:
    """Work before a new run's first step, such as a warm start; once."""

  def begin_episode(self) -> None:
    """Called after each reset, before the first action."""

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Chooses the exploring action, float32 [A]; steps the scheduler."""

  def next_period(self, env_step: int) -> Period:
    """Steps the scheduler for an actor elsewhere; in place of `act`.

    Args:
      env_step: steps of the run before the period.
    """

  def end_episode(self, episode: "Episode") -> None:
    """Called once the episode is complete (the scheduler learns here)."""

  def update(self) -> None:
    """Makes one update of all networks from the replay and the experts."""

  def metrics(self) -> Metrics:
    """Means since the last call, by the names of the metrics contract."""

  def policy_arrays(self) -> dict[str, np.ndarray]:
    """What acting needs, by name: the content of `policy.safetensors`."""

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values: everything a resume needs but the replay."""

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""


class Episode(NamedTuple):
  """A finished episode of T steps, in order."""

  observation: np.ndarray  # float32 [T, O]
  action: np.ndarray  # float32 [T, A]
  rewards: np.ndarray | None = None  # float32 [T, R] if the replay keeps them
