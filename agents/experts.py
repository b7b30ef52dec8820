"""All tasks' demonstrations in one pool on the device, sampled at once."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import torch


class DemonstrationArrays(Protocol):
  """One task's demonstrations as arrays of N rows."""

  @property
  def observation(self) -> np.ndarray:
    """float32 [N, O]."""

  @property
  def action(self) -> np.ndarray:
    """float32 [N, A]."""

  @property
  def next_observation(self) -> np.ndarray:
    """float32 [N, O]."""

  @property
  def is_last(self) -> np.ndarray:
    """Rows of success, bool [N]."""


class ExpertBatch(NamedTuple):
  """Each task's own expert rows."""

  inputs: torch.Tensor  # [K, N, O], standardised
  action: torch.Tensor  # [K, N, A]


class Batch(NamedTuple):
  """Transitions shared by all tasks."""

  inputs: torch.Tensor  # [B, O], standardised
  action: torch.Tensor  # [B, A]
  next_inputs: torch.Tensor  # [B, O], standardised


def pooled_observations(
  demonstrations: Mapping[str, DemonstrationArrays], tasks: Sequence[str]
) -> np.ndarray:
  """All tasks' observations, [sum of N, O].

  Raises:
    ValueError: a task has no demonstrations; the message lists all such.
  """
  missing = [
    task
    for task in tasks
    if task not in demonstrations or not len(demonstrations[task].action)
  ]
  if missing:
    raise ValueError(f"no demonstrations of {', '.join(missing)}")
  return np.concatenate([demonstrations[task].observation for task in tasks])


class ExpertPool:
  """Rows of all tasks one after the other, with offsets."""

  def __init__(
    self,
    demonstrations: Mapping[str, DemonstrationArrays],
    tasks: Sequence[str],
    standardise: Callable[[torch.Tensor], torch.Tensor],
    device: torch.device | str = "cpu",
  ):
    """Copies the demonstrations to the device, standardised.

    Args:
      demonstrations: task -> arrays.
      tasks: the K tasks, in the order of every K axis; main first.
      standardise: raw observations [N, O] -> network inputs.
      device: where to keep them.

    Raises:
      ValueError: a task has no demonstrations.
    """
    observation = pooled_observations(demonstrations, tasks)
    parts = [demonstrations[task] for task in tasks]

    def put(array: np.ndarray) -> torch.Tensor:
      return torch.from_numpy(np.asarray(array, np.float32)).to(device)

    self._inputs = standardise(put(observation))
    self._action = put(np.concatenate([part.action for part in parts]))
    self._next_inputs = standardise(
      put(np.concatenate([part.next_observation for part in parts]))
    )
    self._device = device
    self._tasks = tuple(tasks)
    self._sizes = np.array([len(part.action) for part in parts])
    self._offsets = np.concatenate([[0], np.cumsum(self._sizes)[:-1]])
    last = np.concatenate([part.is_last for part in parts])
    self._finals = np.flatnonzero(last)
    self._final_sizes = np.array([int(part.is_last.sum()) for part in parts])
    self._final_offsets = np.concatenate(
      [[0], np.cumsum(self._final_sizes)[:-1]]
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
      final_rows: how many of these come from rows of success.

    Returns:
      [K, N, ...] tensors; rows of success come last.
    """
    tasks = len(self._sizes)
    index = self._offsets[:, None] + generator.integers(
      self._sizes[:, None], size=(tasks, rows - final_rows)
    )
    if final_rows:
      chosen = self._final_offsets[:, None] + generator.integers(
        self._final_sizes[:, None], size=(tasks, final_rows)
      )
      index = np.concatenate([index, self._finals[chosen]], axis=1)
    at = torch.from_numpy(index).to(self._device)
    return ExpertBatch(self._inputs[at], self._action[at])

  def sample_transitions(
    self, generator: np.random.Generator, rows: int
  ) -> Batch:
    """Draws transitions, split evenly over tasks; the main has the rest.

    Args:
      generator: source of the indices.
      rows: n, transitions in all.

    Returns:
      [n, ...] tensors.
    """
    tasks = len(self._sizes)
    share = rows // tasks
    counts = np.full(tasks, share)
    counts[0] += rows - share * tasks
    task = np.repeat(np.arange(tasks), counts)
    index = self._offsets[task] + generator.integers(self._sizes[task])
    at = torch.from_numpy(index).to(self._device)
    return Batch(self._inputs[at], self._action[at], self._next_inputs[at])
