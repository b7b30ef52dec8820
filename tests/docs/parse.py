"""Parses lines of arguments as a command does, and goes no further.

`python tests/docs/parse.py train "--flagfile=..." "--run=..."`
"""

import functools
import importlib
import os
import sys

from lfgp_dmc.launch import config_flags

_COMMAND = importlib.import_module(f"lfgp_dmc.launch.{sys.argv[1]}")


@functools.wraps(_COMMAND.main)
def _main() -> None:
  if "define_flags" in _COMMAND.cli.keywords:
    with _COMMAND.command.checked_input():
      config_flags.resolved()


failed = False
for line in sys.argv[2:]:
  child = os.fork()
  if not child:
    print(line, file=sys.stderr)
    sys.argv[1:] = line.split()
    _COMMAND.cli.func(_main, **_COMMAND.cli.keywords)
  failed |= bool(os.waitpid(child, 0)[1])
sys.exit(failed)
