"""The replay: raw transitions in a ring, in memory or in mapped files.

Row number `r` (0 for the first ever added) lives at `r % size` of each array,
so one count, how many rows were ever added, says everything. The arrays may
have `slack` rows more than the capacity: rows that left the ring stay intact
that long, so that an episode can be withdrawn, or a checkpoint returned to,
without losing the rows that its own had displaced.
"""

import os
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from lfgp_dmc.data import files
from lfgp_dmc.types import Transition

SIDECAR = "replay.json"
_CHUNK = 16_384  # rows of disk taken at a time


class Replay:
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
  ):
    """Makes an empty replay, or opens the one that `folder` holds.

    Args:
      capacity: most rows that can be sampled; older ones drop out.
      observation_size: O.
      action_size: A.
      folder: where the arrays are mapped (sparse npy files that take disk
        only as they fill); None keeps them in memory.
      reward_tasks: whose dense rewards are kept beside each row, in an
        optional column; none leave it out.
      slack: rows kept intact beyond the capacity; at least the rows added
        between two checkpoints where a full ring must resume exactly.

    Raises:
      ValueError: the folder holds a replay of other sizes, or is damaged.
    """
    if capacity < 1 or slack < 0:
      raise ValueError(f"capacity {capacity} and slack {slack} must be >= 1, 0")
    self._capacity = capacity
    self._size = capacity + slack
    self._widths = {
      "observation": observation_size,
      "action": action_size,
      "next_observation": observation_size,
    }
    self._reward_tasks = tuple(reward_tasks)
    if reward_tasks:
      self._widths["rewards"] = len(reward_tasks)
    self._folder = None if folder is None else pathlib.Path(folder)
    self._total = 0  # rows ever added, less those withdrawn
    self._written = 0  # the most rows ever added: later ones overwrote
    self._low_mark = 0  # the smallest total since it was last asked for
    self._reserved = 0  # rows known to have disk under them
    self._mapped: list[np.memmap] = []
    columns = {name: self._column(name) for name in self._widths}
    if self._folder is not None:
      self._open_sidecar()
    self._observation = columns["observation"]
    self._action = columns["action"]
    self._next_observation = columns["next_observation"]
    self._rewards = columns.get("rewards")

  def __len__(self) -> int:
    """Rows that can be sampled."""
    return self._total - self._start

  @property
  def capacity(self) -> int:
    """The most rows that can be sampled."""
    return self._capacity

  @property
  def widths(self) -> tuple[int, int]:
    """The sizes (O, A) of observations and actions."""
    return self._widths["observation"], self._widths["action"]

  @property
  def total(self) -> int:
    """Rows ever added and not withdrawn: what `rewind` takes."""
    return self._total

  @property
  def reward_tasks(self) -> tuple[str, ...]:
    """The tasks whose rewards are kept, in their order; may be none."""
    return self._reward_tasks

  @property
  def _start(self) -> int:
    """The number of the oldest row that can be sampled."""
    return max(0, self._total - self._capacity, self._written - self._size)

  def add(
    self, transition: Transition, rewards: np.ndarray | None = None
  ) -> None:
    """Appends one transition; `rewards`: one of each of `reward_tasks`.

    Raises:
      OSError: the disk is full; the row is not added.
    """
    row = self._total % self._size
    if row >= self._reserved:
      self._reserve(row)
    self._observation[row] = transition.observation
    self._action[row] = transition.action
    self._next_observation[row] = transition.next_observation
    if self._rewards is not None:
      self._rewards[row] = rewards
    self._total += 1
    self._written = max(self._written, self._total)

  def add_batch(
    self, transitions: Transition, rewards: np.ndarray | None = None
  ) -> None:
    """Appends B transitions, each field [B, ...], in their order."""
    count = len(transitions.observation)
    skipped = max(0, count - self._size)  # would be overwritten at once
    numbers = np.arange(self._total + skipped, self._total + count)
    rows = numbers % self._size
    if len(rows):
      self._reserve(int(rows.max()))
    self._observation[rows] = transitions.observation[skipped:]
    self._action[rows] = transitions.action[skipped:]
    self._next_observation[rows] = transitions.next_observation[skipped:]
    if self._rewards is not None:
      assert rewards is not None, "this replay keeps rewards"
      self._rewards[rows] = rewards[skipped:]
    self._total += count
    self._written = max(self._written, self._total)

  def withdraw(self, rows: int) -> None:
    """Takes the last `rows` rows back, as if they had never been added.

    Rows that they displaced from a full ring return as far as `slack` reaches.
    """
    if not 0 <= rows <= len(self):
      raise ValueError(f"cannot withdraw {rows} of {len(self)} rows")
    self._total -= rows
    self._low_mark = min(self._low_mark, self._total)

  def rewind(self, total: int) -> None:
    """Goes back to when `total` rows had been added (a checkpoint).

    Raises:
      ValueError: those rows are not here, or no longer.
    """
    oldest = max(0, self._written - self._size)
    if not oldest <= total <= self._total:
      raise ValueError(
        f"the replay holds rows {oldest} to {self._total}; it cannot go back "
        f"to {total}"
      )
    self._total = total
    self._low_mark = min(self._low_mark, total)

  def clear(self) -> None:
    """Forgets every row."""
    self._total = self._written = self._low_mark = 0

  def take_low_mark(self) -> int:
    """The smallest `total` since the last call: rows below have not changed."""
    mark, self._low_mark = min(self._low_mark, self._total), self._total
    return mark

  def sample_indices(
    self, generator: np.random.Generator, count: int
  ) -> np.ndarray:
    """Draws `count` indices uniformly, with replacement; int64 [count]."""
    if not len(self):
      raise ValueError("the replay is empty: nothing to sample")
    return generator.integers(len(self), size=count)

  def gather(self, indices: np.ndarray) -> Transition:
    """Copies rows out; index 0 is the oldest row, `len(self) - 1` the newest.

    Args:
      indices: int [B].

    Returns:
      A transition of arrays [B, O], [B, A], [B, O].
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
    files.write_json(self._folder / SIDECAR, self._description())

  def _rows(self, indices: np.ndarray) -> np.ndarray:
    return (np.asarray(indices) + self._start) % self._size

  def _reserve(self, row: int) -> None:
    """Takes disk up to `row`: a mapped write to a full disk would kill us."""
    while self._reserved <= row:
      count = min(_CHUNK, self._size - self._reserved)
      for mapped in self._mapped:
        width = mapped.strides[0]
        start = mapped.offset + self._reserved * width
        with open(str(mapped.filename), "r+b") as file:
          os.posix_fallocate(file.fileno(), start, count * width)
      self._reserved += count

  def _column(self, name: str) -> np.ndarray:
    shape = (self._size, self._widths[name])
    if self._folder is None:
      return np.zeros(shape, np.float32)
    self._folder.mkdir(parents=True, exist_ok=True)
    path = self._folder / f"{name}.npy"
    try:
      if path.exists():
        # A file that was cut is refused by "r"; "r+" would fill it with 0.
        np.lib.format.open_memmap(path, mode="r")
        mapped = np.lib.format.open_memmap(path, mode="r+")
      elif (self._folder / SIDECAR).exists():
        raise ValueError("it is missing")
      else:
        mapped = np.lib.format.open_memmap(
          path, mode="w+", dtype=np.float32, shape=shape
        )
    except ValueError as error:
      raise ValueError(
        f"{path} is damaged: {error}; without the folder {self._folder} the "
        "run can be resumed too, and refills its replay first"
      ) from None
    if mapped.shape != shape or mapped.dtype != np.float32:
      raise ValueError(
        f"{path} is {mapped.dtype} {list(mapped.shape)}; expected float32 "
        f"{list(shape)}"
      )
    self._mapped.append(mapped)
    return np.asarray(mapped)  # plain indexing is faster than memmap's

  def _description(self) -> dict[str, Any]:
    return {
      "total": self._total,
      "written": self._written,
      "capacity": self._capacity,
      "size": self._size,
      "reward_tasks": list(self._reward_tasks),
    }

  def _open_sidecar(self) -> None:
    assert self._folder is not None
    path = self._folder / SIDECAR
    if not path.exists():
      return
    found = files.read_json(path)
    try:
      capacity, size = found["capacity"], found["size"]
      self._total, self._written = found["total"], found["written"]
      reward_tasks = tuple(found.get("reward_tasks", ()))
    except (KeyError, TypeError):
      raise ValueError(f"{os.fspath(path)} is damaged: {found!r}") from None
    if reward_tasks != self._reward_tasks:
      raise ValueError(
        f"{path}: a replay with rewards of {list(reward_tasks)}; expected "
        f"{list(self._reward_tasks)}"
      )
    if (capacity, size) != (self._capacity, self._size):
      raise ValueError(
        f"{path}: a replay of capacity {capacity} (with slack {size}); "
        f"expected {self._capacity} ({self._size})"
      )
