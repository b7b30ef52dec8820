"""Sees to it that pictures can be made without a display; see `make setup`.

Installs Mesa's EGL where it may (root on Debian or Ubuntu), else prints the one
command to run. Training needs no pictures, so this never fails.
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
  # In a new process: this one has looked for the libraries already.
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
