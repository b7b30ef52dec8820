"""Shared types, and the legend of every shape in the project.

Shapes are written `[B, K, A]`:
  B: batch rows.                 K: tasks, in the order of `task_set`.
  A: action dimensions (4).      O: observation dimensions (59).
  N: stored pairs or rows.       H: hidden units.
  T: control steps.              R: tasks whose rewards the replay keeps.
  Frames are [C, H, W, 3]: cameras, pixels' rows and columns, colours.

Units are SI (m, m/s, rad/s, N, N m); quaternions are w x y z.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import dm_env
import numpy as np

from lfgp_dmc.data import files

Metrics = dict[str, float]


class Transition(NamedTuple):
  """One step as the replay stores it, raw; or arrays of steps, [T, ...]."""

  observation: np.ndarray  # float32 [O]
  action: np.ndarray  # float32 [A]
  next_observation: np.ndarray  # float32 [O]


class Step(NamedTuple):
  """One step of an episode."""

  transition: Transition
  timestep: dm_env.TimeStep  # what the action led to


class Episode(NamedTuple):
  """A finished episode of T steps, in order."""

  observation: np.ndarray  # float32 [T, O]
  action: np.ndarray  # float32 [T, A]
  rewards: np.ndarray | None = None  # float32 [T, R] if the replay keeps them


class Actor(Protocol):
  """Plays one task at a time: a scripted expert or a learned intention."""

  def begin(self, task: str, seed: int) -> None:
    """Starts an attempt at `task`; all randomness follows from `seed`."""

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Maps one flat observation, float32 [O], to an action, float32 [A]."""


@runtime_checkable
class Agent(Protocol):
  """Trained by a run; an `ActingAgent` or a `SupervisedAgent`."""

  tasks: tuple[str, ...]

  def update(self) -> None:
    """Makes one update of all networks."""

  def metrics(self) -> Metrics:
    """Means since the last call; the names stay the same."""

  def save_policy(
    self, folder: files.Path, config: Mapping[str, Any], env_step: int
  ) -> None:
    """Writes `policy.safetensors` and `config.json`, which adds to `config`."""

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values: everything a resume needs but the replay."""

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""


@runtime_checkable
class ActingAgent(Agent, Protocol):
  """Learns by acting; see `lfgp_dmc/runs/loop.py`."""

  def prepare(self, progress_bar: bool) -> None:
    """Work before a new run's first step, such as a warm start; once."""

  def begin_episode(self) -> None:
    """Called after each reset, before the first action."""

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Chooses the exploring action, float32 [A]; steps the scheduler."""

  def end_episode(self, episode: Episode) -> None:
    """Called once the episode is complete (the scheduler learns here)."""


@runtime_checkable
class SupervisedAgent(Agent, Protocol):
  """Learns from fixed data by epochs; see `lfgp_dmc/runs/supervised.py`."""

  @property
  def has_converged(self) -> bool:
    """Whether nothing more is to be gained; checked between epochs."""

  def begin_epoch(self) -> int:
    """Shuffles the data; returns how many updates the epoch has."""

  def end_epoch(self) -> None:
    """Validates, also after an epoch that was cut by the run's end."""
