"""Becomes another program, which the kernel kills when its parent dies.

  python child.py PARENT_PID PROGRAM ARGUMENT...

Without it, a run of a lost sweep or Ray worker would go on writing to its
folder, and would hold the folder's lock against the resumed run. Linux only;
elsewhere the program just runs.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1  # prctl(2); survives exec

if __name__ == "__main__":
  if sys.platform == "linux":
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != int(sys.argv[1]):  # already dead
      sys.exit("its parent is dead")
  os.execv(sys.argv[2], sys.argv[2:])
