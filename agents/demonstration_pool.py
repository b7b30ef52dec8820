"""All tasks' demonstrations in one pool on the device, sampled at once."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from lfgp_dmc.agents.batches import Batch, ExpertBatch
from lfgp_dmc.agents.fields import InputsConfig
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.data.demonstrations import Demonstrations


def make_standardiser(
  config: InputsConfig,
  demonstrations: Mapping[str, Demonstrations] | None,
  tasks: Sequence[str],
  observation_size: int,
  action_size: int,
) -> Standardiser:
  """Checks the demonstrations, if any are used, and fits to them if configured.

  Raises:
    ValueError: a task has no demonstrations, or they are of other sizes than
      the environment's O and A.
  """
  standardiser = Standardiser(observation_size, config.tanh_feature_scale)
  if demonstrations is None:
    return standardiser
  observation = _pooled(demonstrations, tasks)
  for task in tasks:
    part = demonstrations[task]
    sizes = (part.observation.shape[1], part.action.shape[1])
    if sizes != (observation_size, action_size):
      raise ValueError(
        f"demonstrations of {task}: observation and action have {sizes} "
        f"floats; the environment has {(observation_size, action_size)}"
      )
  if config.standardise:
    standardiser.fit(observation)
  return standardiser


def _pooled(
  demonstrations: Mapping[str, Demonstrations], tasks: Sequence[str]
) -> np.ndarray:
  """All tasks' observations, [sum of N, O]."""
  missing = [
    task
    for task in tasks
    if task not in demonstrations or not len(demonstrations[task])
  ]
  if missing:
    raise ValueError(f"no demonstrations of {', '.join(missing)}")
  return np.concatenate([demonstrations[task].observation for task in tasks])


class ExpertPool:
  """The rows of all tasks, concatenated."""

  def __init__(
    self,
    demonstrations: Mapping[str, Demonstrations],
    tasks: Sequence[str],
    standardiser: Standardiser,
  ):
    """Copies the demonstrations to the standardiser's device.

    Raises:
      ValueError: a task has no demonstrations.
    """
    observation = _pooled(demonstrations, tasks)
    parts = [demonstrations[task] for task in tasks]
    device = standardiser.mean.device

    def put(array: np.ndarray) -> torch.Tensor:
      return torch.from_numpy(np.asarray(array, np.float32)).to(device)

    self._observation = put(observation)
    self._action = put(np.concatenate([part.action for part in parts]))
    self._next_observation = put(
      np.concatenate([part.next_observation for part in parts])
    )
    self._standardiser = standardiser
    self._device = device
    self._tasks = tuple(tasks)
    self._sizes = np.array([len(part.action) for part in parts])
    self._offsets = _offsets(self._sizes)
    last = np.concatenate([part.is_last for part in parts])
    self._finals = np.flatnonzero(last)
    self._final_sizes = np.array([int(part.is_last.sum()) for part in parts])
    self._final_offsets = _offsets(self._final_sizes)
    # A task that has nothing but rows of success draws from them throughout.
    rest = [~p.is_last if not p.is_last.all() else p.is_last for p in parts]
    self._rest = np.flatnonzero(np.concatenate(rest))
    self._rest_sizes = np.array([int(part.sum()) for part in rest])
    self._rest_offsets = _offsets(self._rest_sizes)
    self.refresh()

  def refresh(self) -> None:
    """Standardises all rows anew, after the standardiser has changed."""
    self._inputs = self._standardiser(self._observation)
    self._next_inputs = self._standardiser(self._next_observation)
    self.next_stds = torch.stack(
      [
        self._next_inputs[start : start + size].std(0, correction=0)
        for start, size in zip(self._offsets, self._sizes, strict=True)
      ]
    )

  def check_finals(self) -> None:
    """Raises ValueError naming the tasks without a row of success."""
    without = [
      task
      for task, size in zip(self._tasks, self._final_sizes, strict=True)
      if not size
    ]
    if without:
      raise ValueError(f"no final transitions (is_last) of {without}")

  def sample(
    self, generator: np.random.Generator, rows: int, final_rows: int = 0
  ) -> ExpertBatch:
    """Draws each task's own pairs, uniformly with replacement.

    Args:
      generator: source of the indices.
      rows: N, pairs a task.
      final_rows: how many of these come from rows of success; the others
        then come from the rest of the task's rows, if it has any.

    Returns:
      [K, N, ...] tensors; rows of success come last.
    """
    tasks = len(self._sizes)
    if not final_rows:
      index = self._offsets[:, None] + generator.integers(
        self._sizes[:, None], size=(tasks, rows)
      )
    else:
      rest = self._rest_offsets[:, None] + generator.integers(
        self._rest_sizes[:, None], size=(tasks, rows - final_rows)
      )
      chosen = self._final_offsets[:, None] + generator.integers(
        self._final_sizes[:, None], size=(tasks, final_rows)
      )
      index = np.concatenate([self._rest[rest], self._finals[chosen]], axis=1)
    at = torch.from_numpy(index).to(self._device)
    return ExpertBatch(self._inputs[at], self._action[at])

  def sample_transitions(
    self, generator: np.random.Generator, rows: int
  ) -> Batch:
    """Draws transitions, in equal shares; the rest are the main task's.

    Args:
      generator: source of the indices.
      rows: n, transitions in all.

    Returns:
      [n, ...] tensors.
    """
    task = self.split(rows)
    index = self._offsets[task] + generator.integers(self._sizes[task])
    at = torch.from_numpy(index).to(self._device)
    return Batch(self._inputs[at], self._action[at], self._next_inputs[at])

  def sample_finals(
    self, generator: np.random.Generator, task: np.ndarray
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Draws what rows of success of `task`, int64 [n], led to.

    Returns:
      Inputs [n, O], and the actions of the rows, [n, A].
    """
    chosen = self._final_offsets[task] + generator.integers(
      self._final_sizes[task]
    )
    at = torch.from_numpy(self._finals[chosen]).to(self._device)
    return self._next_inputs[at], self._action[at]

  def split(self, rows: int) -> np.ndarray:
    """The task of each of `rows` rows: equal shares, the rest the main's."""
    tasks = len(self._sizes)
    counts = np.full(tasks, rows // tasks)
    counts[0] += rows % tasks
    return np.repeat(np.arange(tasks), counts)


def _offsets(sizes: np.ndarray) -> np.ndarray:
  """Where each part starts, if parts of these sizes lie end to end."""
  return np.concatenate([[0], np.cumsum(sizes)[:-1]])
