"""Settings of this process for libraries: their threads, and memory.

Those of threads are variables that libraries read when they are loaded.
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
_HEAP, _HUGE_PAGE = 1 << 29, 1 << 21
_MOST = 1 << 25  # that all versions of malloc take from the heap, not apart
_MADV_HUGEPAGE = 14  # from Linux; the others from glibc's malloc.h
_TRIM_THRESHOLD, _TOP_PAD, _MMAP_THRESHOLD = -1, -2, -3


def wait_passively() -> None:
  """Lets waiting threads sleep, unless the user said how they wait."""
  if not {*_PASSIVE, "GOMP_SPINCOUNT"} & os.environ.keys():
    os.environ.update(_PASSIVE)


def keep_memory() -> None:
  """Lets glibc's malloc keep what is freed, in huge pages if there are any.

  An update would otherwise have large tensors' pages mapped anew, eleven
  thousand times with the paper's networks; huge pages save 5 to 10 % of it.
  Takes addresses, no memory.
  """
  libc = ctypes.CDLL(None)
  if not hasattr(libc, "mallopt"):
    return
  libc.mallopt(_TRIM_THRESHOLD, 1 << 30)
  libc.mallopt(_MMAP_THRESHOLD, _MOST)
  libc.mallopt(_TOP_PAD, _HEAP)
  libc.malloc.restype = libc.sbrk.restype = ctypes.c_void_p
  libc.free(ctypes.c_void_p(libc.malloc(ctypes.c_size_t(_MOST // 2))))
  end = libc.sbrk(0)  # of the heap, which has just grown
  start = -(-(end - _HEAP) // _HUGE_PAGE) * _HUGE_PAGE
  size = ctypes.c_size_t(end - start)
  libc.madvise(ctypes.c_void_p(start), size, _MADV_HUGEPAGE)
  libc.mallopt(_TOP_PAD, _HUGE_PAGE)
