"""Frames on disk: more of them than memory should hold."""

import tempfile

import h5py
import numpy as np

_BLOCK = 16  # rows that are compressed together


class FrameFile:
  """Frames in an unnamed file, which goes with its last user.

  It lies where TMPDIR says. Its pages are the system's to drop: a row is read
  when it is needed.
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


def pack(file: h5py.File, name: str, frames: np.ndarray) -> None:
  """Writes a dataset block by block, with a checksum on each."""
  stored = file.create_dataset(
    name,
    frames.shape,
    np.uint8,
    chunks=(min(_BLOCK, len(frames)), *frames.shape[1:]),
    compression="gzip",
    compression_opts=1,
    fletcher32=True,
  )
  for start in range(0, len(frames), _BLOCK):
    stored[start : start + _BLOCK] = frames[start : start + _BLOCK]


def unpack(stored: h5py.Dataset) -> np.ndarray:
  """A dataset's rows in an unnamed file; what are no frames are not read."""
  if stored.ndim != 5 or stored.dtype != np.uint8:
    return np.broadcast_to(np.zeros((), stored.dtype), stored.shape)
  unpacked = FrameFile(stored.shape[1:])
  for start in range(0, len(stored), _BLOCK):
    unpacked.append(stored[start : start + _BLOCK])
  return unpacked.mapped()
