"""Where the runs of a sweep happen: processes here, or a Ray cluster.

Both start `launch/train.py` as its own process with one thread, and report its
exit status. The process dies with its starter.
"""

import asyncio
import os
import pathlib
import platform
import shlex
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from absl import logging

from lfgp_dmc import threads
from lfgp_dmc.launch.command import UserError

_TRAIN = pathlib.Path(__file__).parents[1] / "train.py"
_CHILD = pathlib.Path(__file__).with_name("child.py")


class LocalEngine:
  """One process a run on this machine; at most `slots` at a time."""

  def __init__(self, slots: int):
    self.slots = slots
    self._running: dict[str, subprocess.Popen] = {}

  def start(
    self, name: str, arguments: Sequence[str], log: pathlib.Path
  ) -> None:
    """Starts `launch/train.py`; its output is appended to `log`."""
    self._running[name] = popen(arguments, log)

  def ended(self) -> Mapping[str, int]:
    """Name -> exit status of the runs that ended since the last call."""
    over = {
      name: status
      for name, process in self._running.items()
      if (status := process.poll()) is not None
    }
    for name in over:
      del self._running[name]
    return over

  def interrupt(self) -> None:
    """Requests a checkpoint and the end of all runs."""
    for process in self._running.values():
      process.terminate()

  def kill(self) -> None:
    """Ends all runs at once."""
    for process in self._running.values():
      os.killpg(process.pid, signal.SIGKILL)


class RayEngine:
  """One actor a run on a Ray cluster, whose nodes share the runs' folder.

  Ray places the actors, notices lost nodes, and ends the actors with the sweep.
  """

  def __init__(self, address: str, slots: int = 0):
    """Connects; `slots` 0: as many runs as the cluster has cores.

    Raises:
      UserError: Ray is not installed, or there is no such cluster.
    """
    try:
      import ray
    except ImportError:
      raise UserError(
        "--ray_address needs Ray: pip install 'lfgp-dmc[ray]'"
      ) from None
    try:
      ray.init(address, log_to_driver=False, configure_logging=False)
    except (ConnectionError, ValueError, RuntimeError) as error:
      raise UserError(f"--ray_address={address}: {error}") from None
    self._ray, self._slots = ray, slots
    self._make_run: Any = ray.remote(num_cpus=1)(_RayRun)
    self._running: dict[str, tuple[Any, Any]] = {}  # actor, exit status to be

  @property
  def slots(self) -> int:
    """See `LocalEngine`; follows the nodes that join and leave."""
    cores = self._ray.cluster_resources().get("CPU", 0)
    return self._slots or max(1, int(cores))

  def start(self, name, arguments, log) -> None:
    """See `LocalEngine`."""
    run = self._make_run.remote(os.getcwd(), arguments, log)
    self._running[name] = run, run.wait.remote()

  def ended(self) -> Mapping[str, int]:
    """See `LocalEngine`; a run that is lost with its node counts as killed."""
    over = {}
    for name, (_, status) in list(self._running.items()):
      if not self._ray.wait([status], timeout=0)[0]:
        continue
      del self._running[name]
      try:
        over[name] = self._ray.get(status)
      except self._ray.exceptions.RayError as error:
        logging.warning("%s: %s", name, error)
        over[name] = -signal.SIGKILL
    return over

  def interrupt(self) -> None:
    """See `LocalEngine`."""
    for run, _ in self._running.values():
      run.terminate.remote()

  def kill(self) -> None:
    """See `LocalEngine`."""
    self._ray.shutdown()


class _RayRun:
  """A run's process on some node of the cluster."""

  def __init__(self, folder: str, arguments: Sequence[str], log: pathlib.Path):
    import ray

    os.chdir(folder)
    node = ray.get_runtime_context().get_node_id()
    self._process = popen(arguments, log, f"{platform.node()}, {node}")

  async def wait(self) -> int:
    """Returns the exit status."""
    return await asyncio.to_thread(self._process.wait)

  async def terminate(self) -> None:
    """Requests a checkpoint and the end."""
    self._process.terminate()


Engine = LocalEngine | RayEngine


def popen(
  arguments: Sequence[str], log: pathlib.Path, place: str = platform.node()
) -> subprocess.Popen:
  """Starts `launch/train.py` in a process group of its own.

  Signals of the terminal do not reach it: the sweep passes one on, once. The
  log gets the command, the place and the output.
  """
  log.parent.mkdir(parents=True, exist_ok=True)
  with open(log, "a", encoding="utf-8") as output:
    # A killed attempt leaves the log within a line.
    lead = "\n" if output.tell() else ""
    output.write(f"{lead}$ train.py {shlex.join(arguments)}  # on {place}\n")
    output.flush()
    python, starter = sys.executable, str(os.getpid())
    return subprocess.Popen(
      [python, str(_CHILD), starter, python, str(_TRAIN), *arguments],
      stdin=subprocess.DEVNULL,
      stdout=output,
      stderr=subprocess.STDOUT,
      env={**os.environ, **threads.ONE},
      start_new_session=True,
    )
