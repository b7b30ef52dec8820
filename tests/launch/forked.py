"""Commands, and functions, in forks of a process that has imported torch.

The import takes most of a command's start. Not the simulator's, for which a
command chooses the graphics first.
"""

import functools
import multiprocessing
import os
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence

import torch  # noqa: F401

import lfgp_dmc.agents.lfgp
import lfgp_dmc.launch.configs  # noqa: F401

_STREAMS = ("stdout", "stderr")


@functools.cache
def server():
  """The context whose processes are such forks."""
  context = multiprocessing.get_context("forkserver")
  context.set_forkserver_preload([__name__])
  return context


def run(
  command: Sequence[str], folder: str, variables: Mapping[str, str]
) -> subprocess.CompletedProcess:
  """Runs a script in a folder, with these environment variables."""
  with tempfile.TemporaryDirectory() as aside:
    arguments = (command, folder, dict(variables), aside)
    process = server().Process(target=_become, args=arguments)
    process.start()
    process.join()
    written = []
    for name in _STREAMS:
      with open(os.path.join(aside, name), encoding="utf-8") as file:
        written.append(file.read())
  return subprocess.CompletedProcess(command, process.exitcode, *written)


def _become(command, folder, variables, aside):
  for descriptor, name in enumerate(_STREAMS, 1):
    os.dup2(os.open(os.path.join(aside, name), os.O_CREAT | os.O_WRONLY),
            descriptor)  # fmt: skip
  os.environ.clear()
  os.environ.update(variables)
  os.chdir(folder)
  sys.argv[:] = command
  sys.path[0] = os.path.dirname(command[0])
  runpy.run_path(command[0], run_name="__main__")
