"""The commands: the composition root, and the only place with flags."""

import os
import sys

# `python launch/train.py` puts this folder in front of everything: there its
# modules, such as `datasets`, would hide a stranger's of the same name.
_HERE = os.path.dirname(os.path.realpath(__file__))
sys.path[:] = [p for p in sys.path if not p or os.path.realpath(p) != _HERE]


def _report(kind, error, trace):
  """In a line also if it comes while a command is imported."""
  if issubclass(kind, KeyboardInterrupt):
    print("\ninterrupted", file=sys.stderr)
  else:
    sys.__excepthook__(kind, error, trace)


sys.excepthook = _report
