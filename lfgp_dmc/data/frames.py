"""Frames on disk: more of them than memory should hold."""

import tempfile

import numpy as np


class FrameFile:
  """Frames in an unnamed file, which goes with its last user.

  Its pages are the system's to drop: a memory-mapped row is read when needed.
  """

  def __init__(self, shape: tuple[int, ...]):
    """Starts empty; `shape` is that of one row, [C, H, W, 3]."""
    self._shape, self._rows = shape, 0
    self._file = tempfile.TemporaryFile()  # noqa: SIM115 - lives with us

  def append(self, frames: np.ndarray) -> None:
    """Appends rows, uint8 [n, C, H, W, 3].

    Raises:
      OSError: the disk is full.
    """
    self._file.write(np.ascontiguousarray(frames, np.uint8).data)
    self._rows += len(frames)

  def mapped(self) -> np.ndarray:
    """All rows so far, uint8 [N, C, H, W, 3], read-only."""
    self._file.flush()
    shape = (self._rows, *self._shape)
    return np.memmap(self._file, np.uint8, "r", shape=shape)
