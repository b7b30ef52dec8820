"""Arrays by name in a safetensors file."""

import pathlib
from collections.abc import Mapping

import numpy as np
import safetensors
import safetensors.numpy

from lfgp_dmc.data import files


def write(path: files.Path, arrays: Mapping[str, np.ndarray]) -> None:
  """Writes a file, whole or not at all; see `files.write_bytes`."""
  # safetensors writes the memory as it lies: it must lie in C order.
  ordered = {name: np.asarray(a, order="C") for name, a in arrays.items()}
  # Not `save_file`, which chooses the file's mode and wraps the disk's errors.
  files.write_bytes(path, safetensors.numpy.save(ordered))


def read(path: files.Path) -> dict[str, np.ndarray]:
  """Reads all arrays.

  Raises:
    OSError: there is no such file, or it may not be read.
    ValueError: it is damaged; the message names it.
  """
  try:
    return safetensors.numpy.load(pathlib.Path(path).read_bytes())
  except (safetensors.SafetensorError, KeyError, TypeError) as error:
    raise ValueError(f"{path}: not readable ({error!r})") from None
