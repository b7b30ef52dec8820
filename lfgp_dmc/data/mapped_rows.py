"""Rows of floats in sparse npy files, which take disk only as they fill."""

import os
import pathlib

import numpy as np

from lfgp_dmc.data import files

_CHUNK = 16_384  # rows of disk taken at a time


def open_rows(
  path: pathlib.Path, shape: tuple[int, int | None], read_only: bool = False
) -> np.memmap:
  """Maps a file of rows [size, width]; width None accepts any.

  Raises:
    ValueError: it is missing, damaged or of another shape; names the file.
  """
  try:
    if not path.exists():
      raise ValueError("it is missing")
    # A file that was cut is refused by "r"; "r+" would fill it with 0.
    mapped = np.lib.format.open_memmap(path, mode="r")
    if not read_only:
      mapped = np.lib.format.open_memmap(path, mode="r+")
  except ValueError as error:
    raise ValueError(f"{path} is damaged: {error}") from None
  size, width = shape
  if width is None and mapped.ndim == 2:
    width = mapped.shape[1]
  valid = (size, width)
  if mapped.shape != valid or mapped.dtype != np.float32:
    raise ValueError(
      f"{path} is {mapped.dtype} {list(mapped.shape)}; expected float32 "
      f"{list(valid)}"
    )
  return mapped


def reserve(mapped: np.memmap, start: int) -> int:
  """Takes disk for rows from `start` on; returns where they end.

  Raises:
    OSError: the disk is full; a mapped write would kill the process there.
  """
  stop = min(start + _CHUNK, len(mapped))
  width = mapped.strides[0]
  name = str(mapped.filename)
  with files.naming(name), open(name, "r+b") as file:
    os.posix_fallocate(
      file.fileno(), mapped.offset + start * width, (stop - start) * width
    )
  return stop
