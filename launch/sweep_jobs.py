"""The runs of a sweep: which there are, what each is called, what is done.

A run is named after its flagfile, main task and seed: `lfgp_stack_0` is
`launch/flags/lfgp.flags` with `--config.main_task=stack --config.seed=0`.
"""

import contextlib
import csv
import dataclasses
import math
import pathlib
from collections.abc import Iterable, Sequence

from lfgp_dmc.data import csv_files, evaluation_csv
from lfgp_dmc.runs import run_folder
from lfgp_dmc.task_names import ALL_TASKS

FLAGS = pathlib.Path(__file__).with_name("flags")
INDEX_NAME = "index.csv"
COLUMNS = ("name", "algorithm", "main_task", "seed", "state", "attempts",
           "wall_s", "env_step", "success", "folder", "message")  # fmt: skip

_STEPS = "--config.env_steps="
_MAY_CHANGE = ("--config.demonstrations=", "--config.evaluation_workers=")
_ENDLESS = 1 << 62

# States, in the life of a run.
WAITING, RUNNING, DONE = "waiting", "running", "done"
FAILED, STOPPED, MISSING = "failed", "stopped", "no flagfile"
HELD = "held"  # another run that it starts from failed or is not there


@dataclasses.dataclass
class Job:
  """One run, and how it is getting on."""

  algorithm: str
  main_task: str
  seed: int
  folder: pathlib.Path
  flagfile: pathlib.Path
  arguments: tuple[str, ...] = ()  # beside flagfile and seed
  after: str = ""  # name of the run that must be done before
  state: str = WAITING
  attempts: int = 0
  wall_s: float = 0.0  # over all attempts, also of earlier sweeps
  message: str = ""

  @property
  def name(self) -> str:
    """Such as lfgp_stack_0."""
    return self.folder.name

  @property
  def steps(self) -> int:
    """How long its arguments let it be; 0: they do not say."""
    given = [a.removeprefix(_STEPS) for a in self.arguments if _STEPS in a]
    return _number(given[-1]) if given else 0

  def _resumed_arguments(self) -> list[str]:
    """What a run that goes on takes: all else is as it was started."""
    known = *_MAY_CHANGE, *((_STEPS,) if self.wants_more_steps() else ())
    return [a for a in self.arguments if a.startswith(known)]

  def wants_more_steps(self) -> bool:
    """Whether its arguments let it be longer than it was started with."""
    return self.steps > _steps_of(self.folder)

  @property
  def log(self) -> pathlib.Path:
    """What the run prints, all attempts in one file."""
    return self.folder.with_name(f"{self.name}.log")

  def train_arguments(self) -> list[str]:
    """Of `launch/train.py`: from the beginning, or on from a checkpoint."""
    if (self.folder / run_folder.CONFIG_NAME).exists():
      return [f"--run={self.folder}", "--resume", *self._resumed_arguments()]
    return [
      f"--flagfile={self.flagfile}",
      f"--config.main_task={self.main_task}",
      f"--config.seed={self.seed}",
      *self.arguments,
      f"--run={self.folder}",
    ]


def make_jobs(
  algorithms: Sequence[str],
  main_tasks: Sequence[str],
  seeds: Iterable[int],
  runs: pathlib.Path,
  arguments: Sequence[str] = (),
  flags: pathlib.Path = FLAGS,
) -> list[Job]:
  """Every algorithm on every main task, seed by seed; each run once.

  Args:
    algorithms: names of flagfiles, such as lfgp or lfgp_play; with a task after
      it, such as lfgp_move_object, on that task alone.
    main_tasks: of the others.
    seeds: of each.
    runs: folder for the runs.
    arguments: more of `launch/train.py`; `{runs}` and `{seed}` are filled in.
    flags: folder of the flagfiles; jobs that find none are `MISSING`.

  Raises:
    ValueError: a name is empty, or a path.
  """
  for name in (*algorithms, *main_tasks):
    if not name or "/" in name:
      raise ValueError(f"{name!r} is no name of a flagfile or a task")
  jobs: dict[str, Job] = {}
  for seed in seeds:
    for algorithm in algorithms:
      stem, tasks = _split(algorithm, main_tasks)
      for main_task in tasks:
        job = Job(
          algorithm,
          main_task,
          seed,
          runs / f"{stem}_{main_task}_{seed}",
          flags / f"{stem}.flags",
          tuple(
            # No format(): other braces are the argument's own.
            _with_two_dashes(argument)
            .replace("{runs}", str(runs))
            .replace("{seed}", str(seed))
            for argument in arguments
          ),
        )
        if not job.flagfile.is_file():
          job.state = MISSING
        jobs.setdefault(job.name, job)
  return [*jobs.values()]


def _with_two_dashes(argument: str) -> str:
  """As train.py takes it with one, too."""
  return f"--{argument.lstrip('-')}" if argument[:1] == "-" else argument


def _number(text: str) -> int:
  """As a flag's; 0: train.py will say that it is none."""
  with contextlib.suppress(ValueError):
    is_decimal = text.lstrip("+-0")[:1] not in ("x", "X", "o", "O")
    return int(text, 10 if is_decimal else 0)
  return 0


def _split(
  algorithm: str, main_tasks: Sequence[str]
) -> tuple[str, Sequence[str]]:
  """The flagfile's name, and the tasks that it is run on."""
  for task in sorted(ALL_TASKS, key=len, reverse=True):
    if algorithm.endswith(f"_{task}"):
      return algorithm.removesuffix(f"_{task}"), (task,)
  return algorithm, main_tasks


def chain(
  jobs: Sequence[Job], starts: Sequence[str], index: pathlib.Path | None = None
) -> None:
  """Says which runs start from which, by `TARGET:SOURCE:FIELD`.

  Such as `lfgp_transfer_stack:lfgp_move_object:config.transfer_from`: that
  run of a seed waits for the source's of the same seed, and gets its folder as
  that field. Sources that are no jobs are done by their evaluation or by the
  index of earlier sweeps. Targets that are none are left alone: a sweep may be
  a part of another.

  Raises:
    ValueError: not of that form; or the index is no sweep's.
  """
  known = {job.name for job in jobs}
  if index is not None:
    known |= {
      row["name"]
      for row in _rows_of(index)
      if row["state"] == DONE
      and (index.parent / row["name"] / run_folder.CONFIG_NAME).is_file()
    }
  bare = {job.flagfile.stem for job in jobs}
  for start in starts:
    parts = start.split(":")
    if len(parts) != 3 or not all(parts):
      raise ValueError(f"{start!r}; valid: TARGET:SOURCE:config.FIELD")
    target, source, field = parts
    if target in bare:
      raise ValueError(
        f"{start!r}; valid: a TARGET with its task, such as lfgp_stack"
      )
    for job in jobs:
      if job.name != f"{target}_{job.seed}":
        continue
      job.after = f"{source}_{job.seed}"
      folder = job.folder.with_name(job.after)
      job.arguments = (*job.arguments, f"--{field}={folder}")
      is_there = job.after in known or _is_done(folder)
      if job.state == WAITING and not is_there:
        job.state, job.message = HELD, f"{job.after} is not part of the sweep"


def recall(jobs: Sequence[Job], index: pathlib.Path) -> None:
  """Takes over what an earlier sweep knew, and finds what is done."""
  earlier = {row["name"]: row for row in _rows_of(index)}
  for job in jobs:
    row = earlier.get(job.name)
    if row is not None and row["wall_s"]:
      job.wall_s = float(row["wall_s"])
    was_done = row is not None and row["state"] == DONE
    is_there = (job.folder / run_folder.CONFIG_NAME).is_file()
    if not is_there or job.wants_more_steps():
      continue
    if was_done or _is_done(job.folder):
      job.state = DONE


def write_index(jobs: Sequence[Job], index: pathlib.Path) -> None:
  """Writes a row a run, whole or not at all; other sweeps' rows stay."""
  own = {job.name for job in jobs}
  rows: list[dict] = [r for r in _rows_of(index) if r["name"] not in own]
  for job in jobs:
    step, success = _last_success(job.folder)
    found = {
      "env_step": step,
      "success": success,
      "wall_s": f"{job.wall_s:.0f}",
    }
    rows.append(
      {k: found[k] if k in found else getattr(job, k) for k in COLUMNS}
    )
  csv_files.write(index, COLUMNS, rows)


def _rows_of(index: pathlib.Path) -> list[dict[str, str]]:
  """What earlier sweeps wrote; raises ValueError if they did not."""
  if not index.is_file():
    return []
  columns, rows = csv_files.read(index)
  if columns != list(COLUMNS):
    raise ValueError(f"{index} is no sweep's: its columns are {columns}")
  return rows


def _steps_of(folder: pathlib.Path) -> int:
  """How long a run's own config lets it be."""
  try:
    return int(run_folder.read_config(folder).get("env_steps", _ENDLESS))
  except ValueError:
    return _ENDLESS


def _is_done(folder: pathlib.Path) -> bool:
  """Whether a run was evaluated at its last step; says nothing of BC."""
  step = _last_success(folder)[0]
  return step != "" and int(step) >= _steps_of(folder)


def _last_success(folder: pathlib.Path) -> tuple[str, str]:
  """The last evaluation of the main task: its step, and share of successes."""
  try:
    main_task = str(run_folder.read_config(folder).get("main_task"))
    rows = evaluation_csv.read_csv(folder / "evaluation.csv")
  except (OSError, ValueError, csv.Error):
    return "", ""
  rows = evaluation_csv.newest(row for row in rows if row.task == main_task)
  if not rows:
    return "", ""
  rate = evaluation_csv.success_rates(rows)[main_task]
  return str(rows[0].env_step), "" if math.isnan(rate) else f"{rate:.3f}"
