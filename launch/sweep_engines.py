"""Where the runs of a sweep happen: processes here, or a Ray cluster.

Both start `launch/train.py` as its own process with one thread, and tell how it
ended by its exit status.
"""

import os
import pathlib
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from typing import Protocol

from lfgp_dmc.launch.command import UserError

_TRAIN = pathlib.Path(__file__).with_name("train.py")
_POLL = 0.2  # s
_KILL = "kill"  # in a stop file; an empty one asks for a checkpoint first
_KILL = "kill"  # in a stop file; an empty one asks for a checkpoint first
_VARIABLES = {
  "OMP_NUM_THREADS": "1",
  "MKL_NUM_THREADS": "1",
  "OPENBLAS_NUM_THREADS": "1",
  "OMP_WAIT_POLICY": "PASSIVE",
}


class Engine(Protocol):
  """Starts runs and says which ended."""

  @property
  def slots(self) -> int:
    """How many runs at a time."""

  def start(self, name: str, arguments: Sequence[str], log: pathlib.Path):
    """Starts `launch/train.py`; its output is appended to `log`."""

  def ended(self) -> Mapping[str, int]:
    """Name -> exit status of the runs that ended since the last call."""

  def interrupt(self) -> None:
    """Asks all runs to write a checkpoint and end."""

  def kill(self) -> None:
    """Ends all runs at once."""


class LocalEngine:
  """One process a run on this machine."""

  def __init__(self, slots: int):
    self.slots = slots
    self._running: dict[str, subprocess.Popen] = {}

  def start(self, name, arguments, log) -> None:
    """See `Engine`."""
    self._running[name] = popen(arguments, log)

  def ended(self) -> Mapping[str, int]:
    """See `Engine`."""
    over = {
      name: status
      for name, process in self._running.items()
      if (status := process.poll()) is not None
    }
    for name in over:
      del self._running[name]
    return over

  def interrupt(self) -> None:
    """See `Engine`."""
    for process in self._running.values():
      process.terminate()

  def kill(self) -> None:
    """See `Engine`."""
    for process in self._running.values():
      os.killpg(process.pid, signal.SIGKILL)


class RayEngine:
  """One task a run on a Ray cluster, whose nodes share the runs' folder."""

  def __init__(self, address: str, slots: int = 0):
    """Connects.

    Args:
      address: of the cluster, or "" to start one on this machine.
      slots: runs at a time; 0: as many as the cluster has cores.

    Raises:
      UserError: Ray is not installed, or there is no such cluster.
    """
    try:
      import ray
    except ImportError:
      raise UserError(
        "--engine=ray needs Ray: pip install 'lfgp-dmc[ray]'"
      ) from None
    self._ray = ray
    try:
      ray.init(
        address=address or None,
        num_cpus=None if address else slots or None,
        include_dashboard=None if address else False,
        log_to_driver=False,
        configure_logging=False,
      )
    except (ConnectionError, ValueError, RuntimeError) as error:
      raise UserError(f"--ray_address={address}: {error}") from None
    self.slots = slots or int(ray.cluster_resources().get("CPU", 1))
    # A run that is lost with its node is the sweep's to start again.
    self._run = ray.remote(num_cpus=1, max_retries=0)(_train_and_wait)
    self._running: dict[str, object] = {}
    self._stops: dict[str, pathlib.Path] = {}

  def start(self, name, arguments, log) -> None:
    """See `Engine`."""
    _stop_file(log).unlink(missing_ok=True)
    self._stops[name] = _stop_file(log)
    self._running[name] = self._run.remote(list(arguments), str(log))

  def ended(self) -> Mapping[str, int]:
    """See `Engine`."""
    if not self._running:
      return {}
    names = {reference: name for name, reference in self._running.items()}
    ready, _ = self._ray.wait(
      list(names), num_returns=len(names), timeout=0, fetch_local=False
    )
    over = {}
    for reference in ready:
      try:
        over[names[reference]] = self._ray.get(reference)
      except self._ray.exceptions.RayError:  # its process or node is gone
        over[names[reference]] = -signal.SIGKILL
      del self._running[names[reference]]
    return over

  def interrupt(self) -> None:
    """See `Engine`."""
    for name in self._running:  # Ray workers block SIGINT, so cancel() fails
      self._stops[name].touch()

  def kill(self) -> None:
    """See `Engine`."""
    for name in self._running:
      self._stops[name].write_text(_KILL, encoding="utf-8")
    time.sleep(5 * _POLL)  # until the workers have seen it


def _stop_file(log: str | pathlib.Path) -> pathlib.Path:
  """Where the sweep asks a run on another machine to stop."""
  return pathlib.Path(log).with_suffix(".stop")


def popen(arguments: Sequence[str], log: pathlib.Path) -> subprocess.Popen:
  """Starts `launch/train.py` in a process group of its own.

  Signals of the terminal do not reach it: the sweep passes one on, once.
  """
  log.parent.mkdir(parents=True, exist_ok=True)
  with open(log, "a", encoding="utf-8") as output:
    output.write(f"$ train.py {' '.join(arguments)}\n")
    output.flush()
    return subprocess.Popen(
      [sys.executable, str(_TRAIN), *arguments],
      stdin=subprocess.DEVNULL,
      stdout=output,
      stderr=subprocess.STDOUT,
      env={**os.environ, **_VARIABLES},
      start_new_session=True,
    )


def _train_and_wait(arguments: list[str], log: str) -> int:
  """What a Ray worker does for one run."""
  stop = _stop_file(log)
  process = popen(arguments, pathlib.Path(log))
  while process.poll() is None:
    if stop.exists():
      if stop.read_text(encoding="utf-8") == _KILL:
        os.killpg(process.pid, signal.SIGKILL)
      process.terminate()
      stop.unlink()
    time.sleep(_POLL)
  return process.returncode
