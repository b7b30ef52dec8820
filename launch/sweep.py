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
from collections.abc import Sequence

from absl import flags

import lfgp_dmc
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.sweeps import engines, jobs, starts
from lfgp_dmc.launch.sweeps.index import Index
from lfgp_dmc.launch.sweeps.jobs import Job
from lfgp_dmc.launch.sweeps.loop import Sweep

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
  "flagfiles", str(jobs.FLAGS), "Folder of the runs' flagfiles."
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


def main() -> int:
  """Runs what is not done; the exit status is 0 if all is."""
  runs = pathlib.Path(_RUNS.value)
  index = Index(runs)
  with command.checked_input():
    todo = _jobs(runs)
    starts.chain(todo, _STARTS.value, index.done())
    index.recall(todo)
  if _DRY_RUN.value:
    for job in todo:
      arguments = shlex.join(job.train_arguments())
      print(f"{job.state:<12} {job.name:<32} {arguments}")
    print(_summary(todo))
    return 0
  if missing := [j for j in todo if j.state == jobs.MISSING]:
    names = dict.fromkeys(str(job.flagfile) for job in missing)
    raise UserError(f"no flagfile {', '.join(names)}; see --dry_run")
  runs.mkdir(parents=True, exist_ok=True)
  engine: engines.Engine
  if _RAY_ADDRESS.value:
    engine = engines.RayEngine(_RAY_ADDRESS.value, _WORKERS.value)
  else:
    engine = engines.LocalEngine(_WORKERS.value or command.cores())
  was_stopped = Sweep(todo, index, _RESTARTS.value).run(engine)
  print(f"{_summary(todo)}\n{index.path}")
  if was_stopped:
    return command.INTERRUPTED
  return int(any(job.state != jobs.DONE for job in todo))


def _jobs(runs: pathlib.Path) -> list[Job]:
  try:
    seeds = [int(seed) for seed in _SEEDS.value]
  except ValueError as error:
    raise UserError(f"--seeds: {error}; valid: integers") from None
  return jobs.make_jobs(
    _ALGORITHMS.value,
    _MAIN_TASKS.value,
    seeds,
    runs,
    _TRAIN.value,
    pathlib.Path(_FLAGFILES.value),
  )


def _summary(todo: Sequence[Job]) -> str:
  counts = collections.Counter(job.state for job in todo)
  return f"{len(todo)} runs: " + ", ".join(
    f"{count} {state}" for state, count in counts.items()
  )


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
