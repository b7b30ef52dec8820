"""All tasks' demonstrations in one pool on the device, sampled at once."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import torch
from torch.nn import functional

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
  features: int = 0,
) -> Standardiser:
  """Checks the demonstrations, if any are used, and fits to them if configured.

  An encoder's features, if there are any, come behind an observation's floats.

  Raises:
    ValueError: a task has no demonstrations, or they are of other sizes than
      the environment's O and A.
  """
  size = observation_size + features
  standardiser = Standardiser(size, config.tanh_feature_scale)
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
  """The rows of all tasks, concatenated, on the standardiser's device."""

  def __init__(
    self,
    demonstrations: Mapping[str, Demonstrations],
    tasks: Sequence[str],
    standardiser: Standardiser,
    final_rows: int = 1,
  ):
    """Copies the demonstrations; an attempt's last `final_rows` are finals.

    Raises:
      ValueError: a task has no demonstrations.
    """
    observation = _pooled(demonstrations, tasks)
    parts = [demonstrations[task] for task in tasks]
    self._device = standardiser.mean.device

    def put(array: np.ndarray) -> torch.Tensor:
      return torch.from_numpy(np.asarray(array, np.float32)).to(self._device)

    self._observation = put(observation)
    self._action = put(np.concatenate([part.action for part in parts]))
    self._next_observation = put(
      np.concatenate([part.next_observation for part in parts])
    )
    self._standardiser = standardiser
    self._tasks = tuple(tasks)
    last = [_last_rows(part, final_rows) for part in parts]
    self._all = _Rows([np.ones_like(part) for part in last])
    self._finals = _Rows(last)
    # A task that has nothing but rows of success draws from them throughout.
    self._rest = _Rows([part if part.all() else ~part for part in last])
    self.refresh()

  def refresh(self) -> None:
    """Standardises all rows anew, after the standardiser has changed."""
    self._inputs = self._standardiser(self._observation)
    self._next_inputs = self._standardiser(self._next_observation)
    parts = self._next_inputs.split(self._all.sizes.tolist())
    self.next_stds = torch.stack([part.std(0, correction=0) for part in parts])

  def check_finals(self) -> None:
    """Raises ValueError naming the tasks without a row of success."""
    sizes = zip(self._tasks, self._finals.sizes, strict=True)
    if without := [task for task, size in sizes if not size]:
      raise ValueError(f"no final transitions (is_last) of {without}")

  def sample(
    self, generator: np.random.Generator, rows: int, final_rows: int = 0
  ) -> ExpertBatch:
    """Draws `rows` of each task's own pairs, uniformly with replacement.

    So many of them are rows of success, which come last; the others then come
    from the rest of the task's rows, if it has any.
    """
    tasks = np.arange(len(self._tasks))[:, None]
    if not final_rows:
      index = self._all.draw(generator, tasks, rows)
    else:
      rest = self._rest.draw(generator, tasks, rows - final_rows)
      finals = self._finals.draw(generator, tasks, final_rows)
      index = np.concatenate([rest, finals], axis=1)
    at = torch.from_numpy(index).to(self._device)
    return ExpertBatch(*_gathered(at, self._inputs, self._action))

  def sample_transitions(
    self, generator: np.random.Generator, rows: int, main_share: float = 0.0
  ) -> Batch:
    """Draws `rows` transitions, of tasks as by `split`."""
    at = self._all.draw(generator, self.split(rows, main_share))
    index = torch.from_numpy(at).to(self._device)
    parts = self._inputs, self._action, self._next_inputs
    return Batch(*_gathered(index, *parts))

  def sample_finals(
    self, generator: np.random.Generator, task: np.ndarray
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Draws rows of success of tasks int64 [n].

    The inputs [n, O] that they led to, and their actions [n, A].
    """
    at = torch.from_numpy(self._finals.draw(generator, task)).to(self._device)
    inputs, action = _gathered(at, self._next_inputs, self._action)
    return inputs, action

  def split(self, rows: int, main_share: float = 0.0) -> np.ndarray:
    """The task of each of `rows` rows: equal shares, the rest the main's.

    With a share of its own, the main task has that first.
    """
    tasks = len(self._tasks)
    others = rows // tasks
    if main_share and tasks > 1:
      others = (rows - int(main_share * rows)) // (tasks - 1)
    counts = np.full(tasks, others)
    counts[0] = rows - others * (tasks - 1)
    return np.repeat(np.arange(tasks), counts)


class _Rows:
  """Some of each task's rows, where all tasks' lie end to end in the pool."""

  def __init__(self, chosen: Sequence[np.ndarray]):
    self.sizes = np.array([int(part.sum()) for part in chosen])
    self._starts = np.cumsum(self.sizes) - self.sizes
    self._rows = np.flatnonzero(np.concatenate(chosen))

  def draw(
    self,
    generator: np.random.Generator,
    task: np.ndarray,
    columns: int | None = None,
  ) -> np.ndarray:
    """A row of each of tasks [n]; or, for [n, 1], as many as columns."""
    size = None if columns is None else (len(task), columns)
    within = generator.integers(self.sizes[task], size=size)
    return self._rows[self._starts[task] + within]


def _last_rows(part: Demonstrations, count: int) -> np.ndarray:
  """The last `count` rows of every whole attempt, bool [N]."""
  chosen = part.is_last.copy()
  for _ in range(count - 1):
    same = part.episode[1:] == part.episode[:-1]
    chosen[:-1] |= chosen[1:] & same
  return chosen


def _gathered(at: torch.Tensor, *parts: torch.Tensor) -> Iterator[torch.Tensor]:
  """Rows of each part; on a CPU, `part[at]` takes several times as long."""
  return (functional.embedding(at, part) for part in parts)
