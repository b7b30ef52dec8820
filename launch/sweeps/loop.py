"""Runs jobs on an engine until none is left, and notes how each ended."""

import pathlib
import signal
import time
from collections.abc import Mapping, Sequence

from absl import logging

from lfgp_dmc import signals
from lfgp_dmc.launch.sweeps.engines import Engine
from lfgp_dmc.launch.sweeps.index import Index
from lfgp_dmc.launch.sweeps.jobs import (
  DONE,
  FAILED,
  HELD,
  MISSING,
  RUNNING,
  STOPPED,
  WAITING,
  Job,
)

_POLL = 0.2  # s
_INDEX_EVERY = 30.0  # s
# Before the second restart, twice that before the third: a file server holds a
# lost machine's lock on a run's folder for up to 90 s.
_REST = 30.0  # s


class Sweep:
  """The loop over jobs and the engine that runs them."""

  def __init__(self, jobs: Sequence[Job], index: Index, restarts: int):
    self._jobs, self._index, self._restarts = jobs, index, restarts
    self._by_name = {job.name: job for job in jobs}
    self._started: dict[str, float] = {}
    self._rests_until: dict[str, float] = {}

  def run(self, engine: Engine) -> bool:
    """Runs until nothing can be run; returns whether it was stopped."""
    written = 0.0
    with signals.stop_request() as stop:
      try:
        while True:
          changed = self._finish(engine.ended(), bool(stop))
          if stop and self._started:
            engine.interrupt()
            logging.warning("waiting for %d checkpoints", len(self._started))
            while self._started:
              changed |= self._finish(engine.ended(), True)
              time.sleep(_POLL)
          if not stop:
            changed |= self._start(engine)
          if changed or time.monotonic() - written > _INDEX_EVERY:
            self._index.write(self._jobs)
            written = time.monotonic()
          is_any_resting = any(
            job.state == WAITING and job.attempts for job in self._jobs
          )
          if not self._started and (stop or not is_any_resting):
            return bool(stop)
          time.sleep(_POLL)
      except KeyboardInterrupt:  # the second request
        engine.kill()
        for name in self._started:
          self._by_name[name].state = STOPPED
        self._index.write(self._jobs)
        raise

  def _start(self, engine: Engine) -> bool:
    """Fills the free slots; returns whether anything was started."""
    before = len(self._started)
    for job in self._jobs:
      if len(self._started) >= engine.slots:
        break
      if job.state != WAITING or not self._may_start(job):
        continue
      engine.start(job.name, job.train_arguments(), job.log)
      job.state, job.message = RUNNING, ""
      job.attempts += 1
      self._started[job.name] = time.monotonic()
      print(f"started {job.name} (attempt {job.attempts})", flush=True)
    return len(self._started) > before

  def _may_start(self, job: Job) -> bool:
    if time.monotonic() < self._rests_until.get(job.name, 0.0):
      return False
    source = self._by_name.get(job.after)
    if source is None or source.state == DONE:
      return True
    if source.state in (FAILED, MISSING, HELD):
      job.state = HELD
      job.message = f"{source.name}: {source.state}"
    return False

  def _finish(self, ended: Mapping[str, int], is_stopping: bool) -> bool:
    """Notes how runs ended; those that died wait for another attempt."""
    for name, status in ended.items():
      job = self._by_name[name]
      job.wall_s += time.monotonic() - self._started.pop(name)
      if status == 0:
        job.state = DONE
      elif is_stopping:
        job.state = STOPPED
      else:
        job.message, is_reported = _last_words(job.log, status)
        # What a first attempt reports is the input's fault and will stay so; a
        # later one may have met the lock of an attempt that is not dead yet.
        is_hopeless = is_reported and job.attempts == 1
        can_retry = job.attempts <= self._restarts and not is_hopeless
        job.state = WAITING if can_retry else FAILED
        rest = (job.attempts - 1) * _REST
        self._rests_until[name] = time.monotonic() + rest
      print(f"{job.state}: {name} {job.message}".rstrip(), flush=True)
    return bool(ended)


def _last_words(log: pathlib.Path, status: int) -> tuple[str, bool]:
  """Why a run ended, and whether it reported so itself in one line."""
  lines = []
  if log.is_file():
    # Progress bars go back to the line's start.
    text = log.read_text(encoding="utf-8", errors="replace")
    lines = [line.rpartition("\r")[2] for line in text.split("\n")]
  if status < 0:
    return f"killed by {signal.Signals(-status).name}", False
  last = [line.strip() for line in lines if line.strip()][-1:] or [""]
  message = f"exit status {status}: {last[0][:200]}"
  errors = [i for i, line in enumerate(lines) if line.startswith("error: ")]
  is_reported = bool(errors) and not any(
    line.startswith(("Traceback", "$ train.py")) for line in lines[errors[-1] :]
  )
  if is_reported:
    message = lines[errors[-1]]
  return message, is_reported
