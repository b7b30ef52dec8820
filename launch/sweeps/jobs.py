"""The runs of a sweep: which there are, what each is called.

A run is named after its flagfile, main task and seed: `lfgp_stack_0` is
`launch/flags/lfgp.flags` with `--config.main_task=stack --config.seed=0`.
"""

import contextlib
import dataclasses
import pathlib
from collections.abc import Iterable, Sequence

from lfgp_dmc.launch.sweeps import progress
from lfgp_dmc.runs import run_folder
from lfgp_dmc.task_names import ALL_TASKS

FLAGS = pathlib.Path(__file__).parents[1] / "flags"
_STEPS = "--config.env_steps="
_MAY_CHANGE = ("--config.demonstrations=", "--config.evaluation_workers=")
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
    return self.steps > progress.steps(self.folder)

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
