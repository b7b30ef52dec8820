"""Arrays by name in a safetensors file, whole or absent."""

import errno
import re
from collections.abc import Mapping

import numpy as np
import safetensors
import safetensors.numpy

from lfgp_dmc.data import files


def write(path: files.Path, arrays: Mapping[str, np.ndarray]) -> None:
  """Writes a whole file, or nothing.

  Raises:
    OSError: the disk is full, or the folder may not be written to.
  """
  # safetensors writes the memory as it lies: it must lie in C order.
  ordered = {name: np.asarray(a, order="C") for name, a in arrays.items()}
  with files.replacing(path) as aside:
    try:
      safetensors.numpy.save_file(ordered, aside)
    except safetensors.SafetensorError as error:
      size = sum(array.nbytes for array in ordered.values()) / 1e6
      number = re.search(r"os error (\d+)", str(error))
      raise OSError(
        int(number[1]) if number else errno.EIO,
        f"{error}; it needs {size:.1f} MB",
      ) from None


def read(path: files.Path) -> dict[str, np.ndarray]:
  """Reads all arrays.

  Raises:
    OSError: there is no such file, or it may not be read.
    ValueError: it is damaged; the message names it.
  """
  # safetensors calls a file that may not be read missing.
  open(path, "rb").close()
  try:
    return safetensors.numpy.load_file(path)
  except (safetensors.SafetensorError, KeyError, TypeError) as error:
    raise ValueError(f"{path}: not readable ({error!r})") from None
