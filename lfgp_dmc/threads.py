"""How threads of torch and other libraries wait, and how many there are.

The libraries read these variables when they are loaded.
"""

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


def wait_passively() -> None:
  """Lets waiting threads sleep, unless the user said how they wait."""
  if not {*_PASSIVE, "GOMP_SPINCOUNT"} & os.environ.keys():
    os.environ.update(_PASSIVE)
