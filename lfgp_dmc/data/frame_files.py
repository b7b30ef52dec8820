"""Frames on disk: more of them than memory should hold."""

import io
import pathlib
import tempfile
from collections.abc import Iterable, Mapping
from typing import Any

import h5py
import numpy as np

from lfgp_dmc.data import files

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
      OSError: the disk is full; names TMPDIR's folder.
    """
    with files.naming(tempfile.gettempdir()):
      self._file.write(np.ascontiguousarray(frames, np.uint8).data)
    self._rows += len(frames)

  def mapped(self) -> np.ndarray:
    """All rows so far, uint8 [N, C, H, W, 3], read-only."""
    with files.naming(tempfile.gettempdir()):
      self._file.flush()
    shape = (self._rows, *self._shape)
    return np.memmap(self._file, np.uint8, "r", shape=shape)


def packed(
  arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any], frames: str
) -> bytes:
  """The HDF5 file of arrays, that of this name as frames, and attributes."""
  content = io.BytesIO()  # HDF5 has no OSError for a full disk
  with h5py.File(content, "w") as file:
    for name, array in arrays.items():
      if name == frames:
        _pack(file, name, array)
      else:
        file.create_dataset(name, data=array)
    for name, value in attributes.items():
      file.attrs[name] = value
  return content.getvalue()


def _pack(file: h5py.File, name: str, frames: np.ndarray) -> None:
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


def _unpack(stored: h5py.Dataset) -> np.ndarray:
  """A dataset's rows in an unnamed file; what are no frames are not read."""
  if stored.ndim != 5 or stored.dtype != np.uint8:
    return np.broadcast_to(np.zeros((), stored.dtype), stored.shape)
  unpacked = FrameFile(stored.shape[1:])
  for start in range(0, len(stored), _BLOCK):
    unpacked.append(stored[start : start + _BLOCK])
  return unpacked.mapped()


def read_all(
  path: pathlib.Path, names: Iterable[str], frames: str
) -> tuple[dict[str, np.ndarray], dict]:
  """Datasets of these names, frames apart, and every attribute of a file."""
  arrays = {}
  with h5py.File(path, "r") as file:
    for name in (*names, frames):
      if isinstance(found := file.get(name), h5py.Dataset):
        size = found.nbytes
        # Compression packs a thousandfold at most.
        if size > 1000 * path.stat().st_size + (1 << 20):
          raise ValueError(f"{name!r} declares {size:,} bytes")
        if name == frames:
          arrays[name] = _unpack(found)
        else:
          arrays[name] = np.asarray(found[()])
    attributes = {
      name: value.item() if isinstance(value, np.generic) else value
      for name, value in file.attrs.items()
    }
  return arrays, attributes
