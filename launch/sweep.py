"""Trains many runs: algorithms x main tasks x seeds.

  python launch/sweep.py --flagfile=launch/flags/paper_sweep.flags
  python launch/sweep.py --algorithms=lfgp,bc --main_tasks=stack --seeds=0,1 \
      --runs=runs/mine --train=--config.env_steps=200000 --dry_run

A run is a flagfile with a main task and a seed. Each gets one process with one
thread; one that dies is resumed from its checkpoint, and what is done is not
done again, so the same command goes on with a sweep that was stopped. What a
run that goes on takes of --train are more steps and where demonstrations are;
all else stays as it was started. Ctrl-C lets the runs write their checkpoints.
RUNS/index.csv has a row a run, RUNS/NAME.log its output. With
--ray_address=auto the runs go to a Ray cluster
instead (`ray start` on each machine). Its nodes share this folder and have the
same Python environment; a run whose node is lost is resumed on another.
"""

import collections
import functools
import pathlib
import shlex
import signal
import time
from collections.abc import Sequence

from absl import flags, logging

import lfgp_dmc
from lfgp_dmc import signals
from lfgp_dmc.launch import command, sweep_engines, sweep_jobs
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.sweep_jobs import Job

_ALGORITHMS = flags.DEFINE_list("algorithms", ["lfgp"], "Names of flagfiles.")
_MAIN_TASKS = flags.DEFINE_list(
  "main_tasks", list(lfgp_dmc.MAIN_TASKS), "Comma-separated."
)
_SEEDS = flags.DEFINE_list("seeds", ["0"], "Comma-separated.")
_RUNS = flags.DEFINE_string("runs", "runs/sweep", "Folder for the runs.")
_TRAIN = flags.DEFINE_multi_string(
  "train",
  [],
  "An argument of launch/train.py for every run, such as "
  "--train=--config.env_steps=1000; {runs} and {seed} are filled in.",
)
_STARTS = flags.DEFINE_multi_string(
  "start_from",
  [],
  "TARGET:SOURCE:config.FIELD: runs of TARGET wait for those of SOURCE with "
  "their seed, whose folders they get as that field.",
)
_FLAGFILES = flags.DEFINE_string(
  "flagfiles", str(sweep_jobs.FLAGS), "Folder of the runs' flagfiles."
)
_WORKERS = flags.DEFINE_integer(
  "workers", 0, "Runs at a time; 0: one a core.", lower_bound=0
)
_RAY_ADDRESS = flags.DEFINE_string(
  "ray_address", "", "Of a cluster, such as auto; default: runs happen here."
)
_RESTARTS = flags.DEFINE_integer(
  "restarts", 3, "How often a run that died is resumed.", lower_bound=0
)
_DRY_RUN = flags.DEFINE_bool("dry_run", False, "Only list the runs.")

_POLL = 0.2  # s
_INDEX_EVERY = 30.0  # s
# Before the second restart, twice that before the third: a file server holds a
# lost machine's lock on a run's folder for up to 90 s.
_REST = 30.0  # s


def main() -> int:
  """Runs what is not done; the exit status is 0 if all is."""
  runs = pathlib.Path(_RUNS.value)
  jobs = _jobs(runs)
  with command.checked_input():
    sweep_jobs.recall(jobs, runs / sweep_jobs.INDEX_NAME)
  if _DRY_RUN.value:
    for job in jobs:
      arguments = shlex.join(job.train_arguments())
      print(f"{job.state:<12} {job.name:<32} {arguments}")
    print(_summary(jobs))
    return 0
  if all(job.state == sweep_jobs.MISSING for job in jobs):
    raise UserError("none of these runs has a flagfile; see --dry_run")
  runs.mkdir(parents=True, exist_ok=True)
  sweep = Sweep(jobs, runs / sweep_jobs.INDEX_NAME, _RESTARTS.value)
  engine: sweep_engines.Engine
  if _RAY_ADDRESS.value:
    engine = sweep_engines.RayEngine(_RAY_ADDRESS.value, _WORKERS.value)
  else:
    engine = sweep_engines.LocalEngine(_WORKERS.value or command.cores())
  was_stopped = sweep.run(engine)
  print(f"{_summary(jobs)}\n{runs / sweep_jobs.INDEX_NAME}")
  if was_stopped:
    return command.INTERRUPTED
  ok = (sweep_jobs.DONE, sweep_jobs.MISSING)
  return int(any(job.state not in ok for job in jobs))


def _jobs(runs: pathlib.Path) -> list[Job]:
  try:
    seeds = [int(seed) for seed in _SEEDS.value]
  except ValueError as error:
    raise UserError(f"--seeds: {error}; valid: integers") from None
  with command.checked_input():
    jobs = sweep_jobs.make_jobs(
      _ALGORITHMS.value,
      _MAIN_TASKS.value,
      seeds,
      runs,
      _TRAIN.value,
      pathlib.Path(_FLAGFILES.value),
    )
    sweep_jobs.chain(jobs, _STARTS.value, runs / sweep_jobs.INDEX_NAME)
  return jobs


def _summary(jobs: Sequence[Job]) -> str:
  counts = collections.Counter(job.state for job in jobs)
  return f"{len(jobs)} runs: " + ", ".join(
    f"{count} {state}" for state, count in counts.items()
  )


class Sweep:
  """The loop over jobs and the engine that runs them."""

  def __init__(self, jobs: Sequence[Job], index: pathlib.Path, restarts: int):
    self._jobs, self._index, self._restarts = jobs, index, restarts
    self._by_name = {job.name: job for job in jobs}
    self._started: dict[str, float] = {}
    self._rests_until: dict[str, float] = {}

  def run(self, engine: sweep_engines.Engine) -> bool:
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
            sweep_jobs.write_index(self._jobs, self._index)
            written = time.monotonic()
          is_any_resting = any(
            job.state == sweep_jobs.WAITING and job.attempts
            for job in self._jobs
          )
          if not self._started and (stop or not is_any_resting):
            return bool(stop)
          time.sleep(_POLL)
      except KeyboardInterrupt:  # the second request
        engine.kill()
        for name in self._started:
          self._by_name[name].state = sweep_jobs.STOPPED
        sweep_jobs.write_index(self._jobs, self._index)
        raise

  def _start(self, engine: sweep_engines.Engine) -> bool:
    """Fills the free slots; returns whether anything was started."""
    before = len(self._started)
    for job in self._jobs:
      if len(self._started) >= engine.slots:
        break
      if job.state != sweep_jobs.WAITING or not self._may_start(job):
        continue
      engine.start(job.name, job.train_arguments(), job.log)
      job.state, job.message = sweep_jobs.RUNNING, ""
      job.attempts += 1
      self._started[job.name] = time.monotonic()
      print(f"started {job.name} (attempt {job.attempts})", flush=True)
    return len(self._started) > before

  def _may_start(self, job: Job) -> bool:
    if time.monotonic() < self._rests_until.get(job.name, 0.0):
      return False
    source = self._by_name.get(job.after)
    if source is None or source.state == sweep_jobs.DONE:
      return True
    if source.state in (sweep_jobs.FAILED, sweep_jobs.MISSING, sweep_jobs.HELD):
      job.state = sweep_jobs.HELD
      job.message = f"{source.name}: {source.state}"
    return False

  def _finish(self, ended, is_stopping: bool) -> bool:
    """Notes how runs ended; those that died wait for another attempt."""
    for name, status in ended.items():
      job = self._by_name[name]
      job.wall_s += time.monotonic() - self._started.pop(name)
      if status == 0:
        job.state = sweep_jobs.DONE
      elif is_stopping:
        job.state = sweep_jobs.STOPPED
      else:
        job.message, is_reported = _last_words(job.log, status)
        # What a first attempt reports is the input's fault and will stay so; a
        # later one may have met the lock of an attempt that is not dead yet.
        is_hopeless = is_reported and job.attempts == 1
        can_retry = job.attempts <= self._restarts and not is_hopeless
        job.state = sweep_jobs.WAITING if can_retry else sweep_jobs.FAILED
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


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
