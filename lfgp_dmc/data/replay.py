"""The replay: raw transitions in a ring, in memory or in mapped files."""

import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from lfgp_dmc.data import files, mapped_rows
from lfgp_dmc.data.ring import Ring
from lfgp_dmc.types import Transition

SIDECAR = "replay.json"
_CHUNK = 65_536  # rows copied at a time


class Replay(Ring):
  """A ring of transitions with uniform sampling."""

  def __init__(
    self,
    capacity: int,
    observation_size: int,
    action_size: int,
    folder: files.Path | None = None,
    *,
    reward_tasks: Sequence[str] = (),
    slack: int = 0,
    read_only: bool = False,
  ):
    """Makes an empty replay, or opens the one that `folder` holds.

    Args:
      capacity: most rows that can be sampled; older ones drop out.
      observation_size: O.
      action_size: A.
      folder: where the arrays are mapped; None keeps them in memory.
      reward_tasks: whose dense rewards are kept beside each row.
      slack: rows kept intact beyond the capacity; at least the rows added
        between two checkpoints where a full ring must resume exactly: with
        less, it resumes without those that were overwritten, and a few more. An
        existing folder keeps its own.
      read_only: whether the folder's files are never written to.

    Raises:
      ValueError: the folder holds a replay of other sizes, or is damaged.
    """
    if folder is not None and (pathlib.Path(folder) / SIDECAR).exists():
      slack = max(0, _read_sidecar(pathlib.Path(folder))["size"] - capacity)
    super().__init__(capacity, slack)
    self.reward_tasks = tuple(reward_tasks)  # the columns of the rewards
    self.widths = (observation_size, action_size)
    self._folder = None if folder is None else pathlib.Path(folder)
    self._read_only = read_only
    self._reserved = 0  # rows known to have disk under them
    self._flushed = 0  # the total at the last flush
    self._promised = self._size  # rows ever added that the sidecar allows for
    self._mapped: list[np.memmap] = []
    self._observation = self._column("observation", observation_size)
    self._action = self._column("action", action_size)
    self._next_observation = self._column("next_observation", observation_size)
    self._rewards = None
    if reward_tasks:
      self._rewards = self._column("rewards", len(reward_tasks))
    if self._folder is not None and (self._folder / SIDECAR).exists():
      self._continue(_read_sidecar(self._folder))

  @classmethod
  def stored(cls, folder: files.Path) -> "Replay":
    """The rows that a run's `replay/` held at its last flush, for reading.

    Raises:
      ValueError: there is no replay, or it is damaged; names the file.
    """
    folder = pathlib.Path(folder)
    found = _read_sidecar(folder)
    capacity, size = found["capacity"], found["size"]
    observation_size, action_size = (
      mapped_rows.open_rows(folder / f"{name}.npy", (size, None), True).shape[1]
      for name in ("observation", "action")
    )
    return cls(
      capacity,
      observation_size,
      action_size,
      folder,
      reward_tasks=found["reward_tasks"],
      slack=size - capacity,
      read_only=True,
    )

  def add(
    self, transition: Transition, rewards: np.ndarray | None = None
  ) -> None:
    """Appends one transition; `rewards`: one of each of `reward_tasks`.

    Raises:
      OSError: the disk is full; the row is not added.
    """
    row = self.total % self._size
    self._put(row, transition, rewards, 1)

  def add_batch(
    self, transitions: Transition, rewards: np.ndarray | None = None
  ) -> None:
    """Appends B transitions, each field [B, ...], in their order."""
    count = len(transitions.observation)
    skipped = max(0, count - self._size)  # would be overwritten at once
    numbers = np.arange(self.total + skipped, self.total + count)
    kept = Transition(*(part[skipped:] for part in transitions))
    if rewards is not None:
      rewards = rewards[skipped:]
    self._put(numbers % self._size, kept, rewards, count)

  def copy_from(self, source: "Replay") -> int:
    """Adds another replay's transitions, the newest that there is room for.

    Rewards are picked by task name. Returns how many rows can be sampled now.

    Raises:
      ValueError: widths differ, or the source keeps no rewards of some task.
    """
    if source.widths != self.widths:
      raise ValueError(
        f"the other run's observations and actions have {source.widths} "
        f"floats; those of this one {self.widths}"
      )
    columns = source.reward_columns(self.reward_tasks)
    first = max(0, len(source) - self.capacity)
    for start in range(first, len(source), _CHUNK):
      indices = np.arange(start, min(start + _CHUNK, len(source)))
      rewards = None
      if columns:
        rewards = source.gather_rewards(indices)[:, columns]
      self.add_batch(source.gather(indices), rewards)
    return len(self)

  def reward_columns(self, tasks: Sequence[str]) -> list[int]:
    """Where the rewards of `tasks` are kept.

    Raises:
      ValueError: some are not; the message names them.
    """
    missing = [task for task in tasks if task not in self.reward_tasks]
    if missing:
      raise ValueError(
        f"the replay keeps no rewards of {', '.join(missing)}; it keeps: "
        f"{', '.join(self.reward_tasks) or 'none'}"
      )
    return [self.reward_tasks.index(task) for task in tasks]

  def gather(self, indices: np.ndarray) -> Transition:
    """Copies rows out: arrays [B, O], [B, A], [B, O].

    Args:
      indices: int [B]; 0 is the oldest row, `len(self) - 1` the newest.
    """
    rows = self._rows(indices)
    return Transition(
      self._observation.take(rows, axis=0),
      self._action.take(rows, axis=0),
      self._next_observation.take(rows, axis=0),
    )

  def gather_rewards(self, indices: np.ndarray) -> np.ndarray:
    """Copies the rewards of rows out: float32 [B, `reward_tasks`]."""
    if self._rewards is None:
      raise ValueError("this replay keeps no rewards (reward_tasks is empty)")
    return self._rewards.take(self._rows(indices), axis=0)

  def flush(self) -> None:
    """Brings all rows and then their count to disk; nothing if in memory."""
    if self._folder is None:
      return
    for mapped in self._mapped:
      mapped.flush()
    self._flushed = self.total
    self._describe(self._written)
    self._promised = self._allowed(self.total)

  def rewind(self, total: int) -> None:
    """See `Ring`; rows up to there are kept from then on."""
    super().rewind(total)
    self._promised = min(self._promised, self._allowed(total))

  def clear(self) -> None:
    """Forgets every row."""
    super().clear()
    self._flushed, self._promised = 0, self._size
    if self._folder is not None and (self._folder / SIDECAR).exists():
      self._describe(0)

  def _allowed(self, total: int) -> int:
    """Rows ever added that overwrite none of a flush at `total`."""
    slack = self._size - self.capacity
    return max(self._size, self._written, total + slack)

  def _describe(self, written: int) -> None:
    """Writes the sidecar."""
    assert self._folder is not None
    description = {
      "total": self._flushed,
      "written": written,
      "capacity": self.capacity,
      "size": self._size,
      "reward_tasks": list(self.reward_tasks),
    }
    files.write_json(self._folder / SIDECAR, description)

  def _put(self, rows, transition: Transition, rewards, count: int) -> None:
    """Writes to `rows` of the arrays; counts `count` new ones."""
    if self._folder is not None and self.total + count > self._promised:
      # Rows of the last flush go: a kill must not leave them in the count.
      promised = self.total + count + self.capacity // 10
      self._describe(promised)
      self._promised = promised
    while self._mapped and self._reserved <= np.max(rows, initial=-1):
      stops = [mapped_rows.reserve(m, self._reserved) for m in self._mapped]
      self._reserved = stops[0]
    self._observation[rows] = transition.observation
    self._action[rows] = transition.action
    self._next_observation[rows] = transition.next_observation
    if self._rewards is not None:
      self._rewards[rows] = rewards
    self._add(count)

  def _column(self, name: str, width: int) -> np.ndarray:
    shape = (self._size, width)
    if self._folder is None:
      return np.zeros(shape, np.float32)
    path = self._folder / f"{name}.npy"
    if not path.exists() and not (self._folder / SIDECAR).exists():
      path.parent.mkdir(parents=True, exist_ok=True)
      mapped = np.lib.format.open_memmap(path, "w+", np.float32, shape)
    else:
      try:
        mapped = mapped_rows.open_rows(path, shape, self._read_only)
      except ValueError as error:
        raise ValueError(
          f"{error}; without the folder {self._folder} the run can be resumed "
          "too, and refills its replay first"
        ) from None
    self._mapped.append(mapped)
    return np.asarray(mapped)  # plain indexing is faster than memmap's

  def _continue(self, found: dict[str, Any]) -> None:
    """Takes the counts of a sidecar, whose sizes must be ours."""
    path = self._folder
    if tuple(found["reward_tasks"]) != self.reward_tasks:
      raise ValueError(
        f"{path}: a replay with rewards of {found['reward_tasks']}; expected "
        f"{list(self.reward_tasks)}"
      )
    capacity, size = found["capacity"], found["size"]
    if (capacity, size) != (self.capacity, self._size):
      raise ValueError(
        f"{path}: a replay of capacity {capacity} (with slack {size}); "
        f"expected {self.capacity} ({self._size})"
      )
    self.total, self._written = found["total"], found["written"]
    self._flushed = self.total
    self._promised = self._allowed(self.total)


def _read_sidecar(folder: pathlib.Path) -> dict[str, Any]:
  path = folder / SIDECAR
  if not path.is_file():
    raise ValueError(f"no replay in {folder}: {path} is missing")
  found = files.read_json(path)
  try:
    counts = ("total", "written", "capacity", "size")
    return {
      **{name: int(found[name]) for name in counts},
      "reward_tasks": list(found.get("reward_tasks", ())),
    }
  except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
    raise ValueError(f"{path} is damaged: {found!r}") from None
