"""What this process tells libraries: of threads, and of memory.

They read variables when they are loaded.
"""

import ctypes
import os

# The second is Intel's. Beside a busy process, threads that spin while they
# wait for each other make two many times slower than one.
_PASSIVE = {"OMP_WAIT_POLICY": "PASSIVE", "KMP_BLOCKTIME": "0"}
ONE = {
  "OMP_NUM_THREADS": "1",
  "MKL_NUM_THREADS": "1",
  "OPENBLAS_NUM_THREADS": "1",
  "LP_NUM_THREADS": "0",  # of Mesa's software GL
  **_PASSIVE,
}
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # glibc's malloc.h


def wait_passively() -> None:
  """Lets waiting threads sleep, unless the user said how they wait."""
  if not {*_PASSIVE, "GOMP_SPINCOUNT"} & os.environ.keys():
    os.environ.update(_PASSIVE)


def keep_freed_memory() -> None:
  """Lets glibc's malloc keep what is freed, instead of giving it back.

  An update would otherwise have large tensors' pages mapped anew: eleven
  thousand times with the paper's networks, a fifth of its time.
  """
  if mallopt := getattr(ctypes.CDLL(None), "mallopt", None):
    mallopt(_MMAP_THRESHOLD, 1 << 25)  # the most that all versions take
    mallopt(_TRIM_THRESHOLD, 1 << 30)
