"""All tasks' demonstrations in one pool on the device, sampled at once."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import torch

from agents import translation


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
  def episode(self) -> np.ndarray:
    """The attempt that each row belongs to, int32 [N]."""

  @property
  def is_last(self) -> np.ndarray:
    """Rows of success, bool [N]."""


class ExpertBatch(NamedTuple):
  """Each task's own expert rows."""

  inputs: torch.Tensor  # [K, N, O], standardised
  action: torch.Tensor  # [K, N, A]


class Batch(NamedTuple):
  """Transitions shared by all tasks, but for examples of success."""

  inputs: torch.Tensor  # [B, O], standardised
  action: torch.Tensor  # [B, A]; of examples: unused
  next_inputs: torch.Tensor  # [B, O], standardised
  reward: torch.Tensor | None = None  # [K, B], where it was stored (SAC-X)
  # int64 [B], where there are examples of success: the task that a row is an
  # example of, or -1 for a transition of the replay.
  owner: torch.Tensor | None = None
  examples: int = 0  # how many of the last rows are examples
  shown: int = 0  # how many of the last rows are the experts'


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


def check_sizes(
  demonstrations: Mapping[str, DemonstrationArrays],
  tasks: Sequence[str],
  observation_size: int,
  action_size: int,
) -> None:
  """Raises ValueError unless all are of the environment's sizes."""
  for task in tasks:
    sizes = (
      demonstrations[task].observation.shape[1],
      demonstrations[task].action.shape[1],
    )
    if sizes != (observation_size, action_size):
      raise ValueError(
        f"demonstrations of {task}: observation and action have {sizes} "
        f"floats; the environment has {(observation_size, action_size)}"
      )


class ExpertPool:
  """Rows of all tasks one after the other, with offsets."""

  def __init__(
    self,
    demonstrations: Mapping[str, DemonstrationArrays],
    tasks: Sequence[str],
    standardise: Callable[[torch.Tensor], torch.Tensor],
    device: torch.device | str = "cpu",
    final_rows: int = 1,
    translation_reach: float = 0.0,
    main_share: float = 0.0,
  ):
    """Copies the demonstrations to the device, standardised.

    Args:
      demonstrations: task -> arrays.
      tasks: the K tasks, in the order of every K axis; main first.
      standardise: raw observations [N, O] -> network inputs.
      device: where to keep them.
      final_rows: how many last rows of an attempt count as rows of success.
      translation_reach: m, rows of tasks that no slot pins are shifted in the
        plane by at most so much, afresh whenever they are drawn.
      main_share: of the transitions for critics, the main task's; 0: as much
        as any other task's.

    Raises:
      ValueError: a task has no demonstrations.
    """
    observation = pooled_observations(demonstrations, tasks)
    parts = [demonstrations[task] for task in tasks]

    def put(array: np.ndarray) -> torch.Tensor:
      return torch.from_numpy(np.asarray(array, np.float32)).to(device)

    self._observation = put(observation)
    self._action = put(np.concatenate([part.action for part in parts]))
    self._next_observation = put(
      np.concatenate([part.next_observation for part in parts])
    )
    self._standardise = standardise
    self._device = device
    self._tasks = tuple(tasks)
    self._sizes = np.array([len(part.action) for part in parts])
    self._offsets = _offsets(self._sizes)
    self._main_share = main_share
    self._reach = np.array(
      [0.0 if t in translation.PINNED else translation_reach for t in tasks]
    )
    lasts = [_last_rows(part, final_rows) for part in parts]
    self._finals = np.flatnonzero(np.concatenate(lasts))
    self._final_sizes = np.array([int(last.sum()) for last in lasts])
    self._final_offsets = _offsets(self._final_sizes)
    # A task that has nothing but rows of success draws from them throughout.
    rest = [~last if not last.all() else last for last in lasts]
    self._rest = np.flatnonzero(np.concatenate(rest))
    self._rest_sizes = np.array([int(part.sum()) for part in rest])
    self._rest_offsets = _offsets(self._rest_sizes)
    self.refresh()

  def refresh(self) -> None:
    """Standardises all rows anew, after the standardiser has changed."""
    self._inputs = self._standardise(self._observation)
    self._next_inputs = self._standardise(self._next_observation)
    self._deviations = torch.stack(
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
    if self._reach.any():
      reach = np.repeat(self._reach[:, None], rows, axis=1)
      inputs, _ = self._shifted(at, reach, generator)
      return ExpertBatch(inputs, self._action[at])
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
    task = self._split(rows)
    index = self._offsets[task] + generator.integers(self._sizes[task])
    at = torch.from_numpy(index).to(self._device)
    if self._reach.any():
      inputs, following = self._shifted(at, self._reach[task], generator)
      return Batch(inputs, self._action[at], following)
    return Batch(self._inputs[at], self._action[at], self._next_inputs[at])

  def sample_examples(
    self, generator: np.random.Generator, rows: int, noise: float
  ) -> Batch:
    """Draws states of success, split as `sample_transitions` splits.

    Each is what a row of success led to. An example stands for staying where
    it is: its next state is itself, with noise of its own.

    Args:
      generator: source of indices and noise.
      rows: n, examples in all.
      noise: standard deviation, in those of the task's own demonstrations.

    Returns:
      [n, ...] tensors with `owner`; the actions are those of the rows.
    """
    task = self._split(rows)
    chosen = self._final_offsets[task] + generator.integers(
      self._final_sizes[task]
    )
    at = torch.from_numpy(self._finals[chosen]).to(self._device)
    owner = torch.from_numpy(task).to(self._device)
    state, deviation = self._next_inputs[at], noise * self._deviations[owner]

    def disturbed() -> torch.Tensor:
      drawn = generator.standard_normal(state.shape, np.float32)
      return state + deviation * torch.from_numpy(drawn).to(self._device)

    return Batch(
      disturbed(), self._action[at], disturbed(), owner=owner, examples=rows
    )

  def _shifted(
    self, at: torch.Tensor, reach: np.ndarray, generator: np.random.Generator
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Inputs of rows and of what follows them, shifted in the plane."""
    observation, following = translation.shifted(
      self._observation[at], self._next_observation[at], reach, generator
    )
    return self._standardise(observation), self._standardise(following)

  def _split(self, rows: int) -> np.ndarray:
    """The task of each of `rows` rows: equal shares, the rest the main's.

    With a share of its own, the main task has that first.
    """
    tasks = len(self._sizes)
    own = int(self._main_share * rows) if tasks > 1 else 0
    counts = np.full(tasks, rows // tasks)
    if own:
      counts[:] = (rows - own) // (tasks - 1)
    counts[0] = rows - counts[1:].sum()
    return np.repeat(np.arange(tasks), counts)


def _offsets(sizes: np.ndarray) -> np.ndarray:
  """Where each part starts, if parts of these sizes lie end to end."""
  return np.concatenate([[0], np.cumsum(sizes)[:-1]])


def _last_rows(part: DemonstrationArrays, count: int) -> np.ndarray:
  """The last `count` rows of every whole attempt, bool [N]."""
  chosen = last = part.is_last.copy()
  for _ in range(count - 1):
    same = part.episode[1:] == part.episode[:-1]
    last = np.append(last[1:] & same, False)
    chosen = chosen | last
  return chosen
