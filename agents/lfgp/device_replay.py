"""A device-side mirror of the replay.

A GPU that fetched its rows from the host for every update would mostly wait.
Here each row crosses over once; batches are then gathered on the device.
"""

import numpy as np
import torch

from lfgp_dmc.data.replay import Replay

_CHUNK = 65_536  # rows copied at a time


class DeviceReplay:
  """A copy of the rows that can be sampled, brought up to date as they grow."""

  def __init__(self, replay: Replay, device: torch.device):
    """Takes memory as rows come: 488 bytes a row at 59 + 4 floats."""
    self._replay = replay
    observations, actions = replay.widths
    self._columns = [
      torch.empty((0, width), device=device)
      for width in (observations, actions, observations)
    ]
    self._copied = 0  # rows below this number are here

  def gather(self, indices: np.ndarray) -> tuple[torch.Tensor, ...]:
    """What `replay.gather(indices)` returns, gathered on the device."""
    self._catch_up()
    oldest = self._replay.total - len(self._replay)
    rows = torch.from_numpy((indices + oldest) % self._replay.capacity)
    rows = rows.to(self._columns[0].device)
    return tuple(column.index_select(0, rows) for column in self._columns)

  def _catch_up(self) -> None:
    """Copies what was added, and anew what was withdrawn and replaced."""
    replay = self._replay
    self._make_room(min(replay.total, replay.capacity))
    mark = min(self._copied, replay.take_low_mark())
    # Rows that those withdrawn had displaced are there again.
    self._copy(mark - replay.capacity, self._copied - replay.capacity)
    self._copy(mark, replay.total)
    self._copied = replay.total

  def _copy(self, start: int, stop: int) -> None:
    """Copies the rows of these numbers that can be sampled."""
    replay = self._replay
    oldest = replay.total - len(replay)
    stop = min(stop, replay.total)
    for first in range(max(start, oldest), stop, _CHUNK):
      numbers = np.arange(first, min(first + _CHUNK, stop))
      rows = torch.from_numpy(numbers % replay.capacity)
      fresh = replay.gather(numbers - oldest)
      for column, values in zip(self._columns, fresh, strict=True):
        rows = rows.to(column.device)
        column[rows] = torch.from_numpy(values).to(column.device)

  def _make_room(self, rows: int) -> None:
    """Doubles the memory when it is full; one column at a time is copied."""
    size = len(self._columns[0])
    if rows <= size:
      return
    size = min(max(rows, 2 * size, _CHUNK), self._replay.capacity)
    for i, column in enumerate(self._columns):
      larger = column.new_empty((size, column.shape[1]))
      larger[: len(column)] = column
      self._columns[i] = larger
