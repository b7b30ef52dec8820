"""Reads the replay of another run, in chunks and without touching it."""

import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from lfgp_dmc.data import files
from lfgp_dmc.data.replay import SIDECAR
from lfgp_dmc.types import Transition

_CHUNK = 65_536  # rows read at a time


class StoredReplay:
  """The rows that a run's `replay/` held when it was last flushed."""

  def __init__(self, folder: files.Path):
    """Opens it for reading.

    Args:
      folder: a run's `replay/`.

    Raises:
      ValueError: there is no replay, or it is damaged; the message names it.
    """
    self._folder = pathlib.Path(folder)
    path = self._folder / SIDECAR
    if not path.is_file():
      raise ValueError(f"no replay in {self._folder}: {path} is missing")
    found: Any = files.read_json(path)
    try:
      self._size = int(found["size"])
      self._stop = int(found["total"])
      self._start = max(
        0,
        self._stop - int(found["capacity"]),
        int(found["written"]) - self._size,
      )
      self.reward_tasks = tuple(found.get("reward_tasks", ()))
    except (KeyError, TypeError, ValueError):
      raise ValueError(f"{path} is damaged: {found!r}") from None
    names = [*Transition._fields, *(["rewards"] if self.reward_tasks else [])]
    self._columns = [self._column(name) for name in names]

  def __len__(self) -> int:
    """Rows that can be read."""
    return self._stop - self._start

  @property
  def widths(self) -> tuple[int, int]:
    """The sizes (O, A) of its observations and actions."""
    return self._columns[0].shape[1], self._columns[1].shape[1]

  def chunks(
    self, newest: int | None = None
  ) -> Iterator[tuple[Transition, np.ndarray | None]]:
    """Yields transitions, float32 [n, ...], and rewards [n, reward_tasks].

    Args:
      newest: leave out all rows but so many; None: none.
    """
    start = self._start
    if newest is not None:
      start = max(start, self._stop - newest)
    for first in range(start, self._stop, _CHUNK):
      rows = np.arange(first, min(first + _CHUNK, self._stop)) % self._size
      arrays = [column[rows] for column in self._columns]
      rewards = arrays[3] if self.reward_tasks else None
      yield Transition(*arrays[:3]), rewards

  def _column(self, name: str) -> np.ndarray:
    path = self._folder / f"{name}.npy"
    try:
      column = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError) as error:
      raise ValueError(f"{path} cannot be read: {error}") from None
    if column.ndim != 2 or len(column) != self._size:
      raise ValueError(
        f"{path} has shape {list(column.shape)}; expected {self._size} rows"
      )
    return column
