"""Which rows of a ring of arrays can be sampled.

Row number `r` (0 for the first ever added) lives at `r % size` of each array,
so one count, how many rows were ever added, says everything. The arrays may
have `slack` rows more than the capacity: rows that left the ring stay intact
that long, so that an episode can be withdrawn, or a checkpoint returned to,
without losing the rows that its own had displaced.
"""

import numpy as np


class Ring:
  """The counts of a ring; the arrays are the subclass's."""

  def __init__(self, capacity: int, slack: int = 0):
    """Starts empty."""
    if capacity < 1 or slack < 0:
      raise ValueError(f"capacity {capacity} and slack {slack} must be >= 1, 0")
    self.capacity = capacity
    self._size = capacity + slack
    self.total = 0  # rows ever added, less those withdrawn; see `rewind`
    self._written = 0  # the most rows ever added: later ones overwrote
    self._low_mark = 0  # the smallest total since it was last requested

  def __len__(self) -> int:
    """Rows that can be sampled."""
    return max(0, self.total - self._start)

  @property
  def _start(self) -> int:
    """The number of the oldest row that can be sampled."""
    return max(0, self.total - self.capacity, self._written - self._size)

  def withdraw(self, rows: int) -> None:
    """Takes the last `rows` rows back, as if they had never been added.

    Rows that they displaced from a full ring return as far as `slack` reaches.
    """
    if not 0 <= rows <= len(self):
      raise ValueError(f"cannot withdraw {rows} of {len(self)} rows")
    self._go_back(self.total - rows)

  def rewind(self, total: int) -> None:
    """Goes back to when `total` rows had been added (a checkpoint).

    Raises:
      ValueError: those rows are not here, or no longer.
    """
    oldest = max(0, self._written - self._size)
    if not oldest <= total <= self.total:
      raise ValueError(
        f"the replay holds rows {oldest} to {self.total}; it cannot go back "
        f"to {total}"
      )
    self._go_back(total)

  def clear(self) -> None:
    """Forgets every row."""
    self.total = self._written = self._low_mark = 0

  def take_low_mark(self) -> int:
    """The smallest `total` since the last call: rows below have not changed."""
    mark, self._low_mark = min(self._low_mark, self.total), self.total
    return mark

  def sample_indices(
    self, generator: np.random.Generator, count: int
  ) -> np.ndarray:
    """Draws `count` indices uniformly, with replacement; int64 [count]."""
    if not len(self):
      raise ValueError("the replay is empty: nothing to sample")
    return generator.integers(len(self), size=count)

  def _rows(self, indices: np.ndarray) -> np.ndarray:
    """Where in the arrays rows are; index 0 is the oldest row."""
    return (np.asarray(indices) + self._start) % self._size

  def _add(self, count: int) -> None:
    """Counts new rows."""
    self.total += count
    self._written = max(self._written, self.total)

  def _go_back(self, total: int) -> None:
    self.total = total
    self._low_mark = min(self._low_mark, total)
