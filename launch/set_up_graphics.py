"""Installs what pictures need without a display; part of `make setup`.

As root on Debian or Ubuntu it installs Mesa's EGL, else it prints the command.
Training needs no pictures, so this never fails.
"""

import os
import shutil
import subprocess
import sys

from lfgp_dmc import graphics


def main() -> int:
  """Checks, installs, checks again."""
  if sys.platform != "linux" or graphics.works_without_display():
    return 0
  update = ["apt-get", "update"]
  install = ["apt-get", "install", "-y", *graphics.PACKAGES]
  if shutil.which("apt-get") and os.geteuid() == 0:
    print("installing GL libraries for pictures without a display", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (update, install):
      subprocess.run(command, env=environment, check=False)
  # In a new process: this one has cached its search for the libraries.
  check = "from lfgp_dmc import graphics as g; print(g.works_without_display())"
  found = subprocess.run(
    [sys.executable, "-c", check], capture_output=True, text=True, check=False
  )
  if found.stdout.strip() != "True":
    print(
      "\nnote: no EGL here, so no pictures and videos; all else works. On "
      f"Debian or Ubuntu:\n  sudo {' '.join(update)} && sudo "
      f"{' '.join(install)}\n"
    )
  return 0


if __name__ == "__main__":
  sys.exit(main())
