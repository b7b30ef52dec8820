"""Evaluates a run, a stored policy or the scripted expert.

  python launch/evaluate.py --run=runs/stack_1 --episodes=50 --tasks=all
  python launch/evaluate.py --run=runs/stack_1 --checkpoints=3 --episodes=100
  python launch/evaluate.py --expert=scripted --tasks=reach,lift

Every intention plays whole episodes in the main task's environment, by its
mean action; the reset of episode i depends on (--seed, i) alone. With
--checkpoints the run's last ones play instead of its policy, each on resets of
its own, from --seed on: their mean is an end that no checkpoint was chosen for.
Episodes go to the run's evaluation.csv, or to that of --output; without it,
those of a policy folder are only printed.
"""

import functools
import pathlib

from absl import flags

import lfgp_dmc
from lfgp_dmc.acting import evaluation
from lfgp_dmc.data import evaluation_csv, files
from lfgp_dmc.launch import command, policies
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.runs import run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.task_names import CONTROL_RATES

_NAME = run_folder.EVALUATION_NAME

_RUN = flags.DEFINE_string("run", "", "A run's folder, or a policy folder.")
_EXPERT = flags.DEFINE_enum(
  "expert", None, [policies.SCRIPTED], "Instead of --run."
)
_TASKS = flags.DEFINE_string(
  "tasks",
  "",
  "Comma-separated intentions, or all; default: the main task alone.",
)
_EPISODES = flags.DEFINE_integer("episodes", 50, "Episodes a task.", 1)
_SEED = flags.DEFINE_integer("seed", 0, "Of the resets.", 0)
_CHECKPOINTS = flags.DEFINE_integer(
  "checkpoints", 0, "With --run: so many of its last checkpoints; see above.", 0
)
_WORKERS = flags.DEFINE_integer(
  "workers", 0, "Processes; 0: one a core.", 0, 4096
)
_MAIN_TASK = flags.DEFINE_enum(
  "main_task",
  None,
  lfgp_dmc.ALL_TASKS,
  "With --expert: whose environment; default: each task in its own.",
)
_HERTZ = flags.DEFINE_integer(
  "control_hz", 20, "With --expert: 20, 10 or 5 control steps a second."
)
_OUTPUT = flags.DEFINE_string(
  "output",
  "",
  "Folder for evaluation.csv; default: the run's own, where training's rows "
  "are kept and those it does not have yet appended. Of a policy folder: none.",
)


def main() -> None:
  """Plays, prints the table, and writes the rows."""
  command.check_choice("control_hz", _HERTZ.value, CONTROL_RATES)
  for flag in (_HERTZ, _MAIN_TASK):
    if flag.present and not _EXPERT.value:
      raise UserError(f"--{flag.name} goes with --expert")
  output = _output()
  if output is not None:
    _known(output)  # better refused now than after all episodes
  rows: list[evaluation_csv.EvaluationRow] = []
  for spec, tasks, seed in _plan():
    found = evaluation.evaluate(
      functools.partial(spec.environment_spec.build, True),
      spec.make,
      tasks,
      _EPISODES.value,
      seed,
      _WORKERS.value or command.cores(),
      env_step=spec.env_step,
      draws=spec.environment_spec.may_draw,
    )
    if _CHECKPOINTS.value:
      print(f"after {spec.env_step} environment steps, resets of seed {seed}:")
      print(f"{evaluation_csv.success_table(found)}\n")
    rows += found
  if _CHECKPOINTS.value:
    print(f"all {_CHECKPOINTS.value} checkpoints:")
  print(evaluation_csv.success_table(rows))
  if output is not None:
    output.parent.mkdir(parents=True, exist_ok=True)
    known = _known(output)
    new = [row for row in rows if row[:4] not in known]
    evaluation_csv.append_csv(output, new)
    print(f"\n{output}")


def _plan() -> list[tuple[policies.PolicySpec, tuple[str, ...], int]]:
  """Policies, their tasks and the seeds of their resets.

  An expert plays each task in its own environment.
  """
  seed, count = _SEED.value, _CHECKPOINTS.value
  if _RUN.value or not _EXPERT.value or count:
    spec = policies.find(_RUN.value, _EXPERT.value)
    specs = policies.at_checkpoints(spec, count) if count else [spec]
    tasks = choose_tasks(_TASKS.value, spec.tasks)
    return [(one, tasks, seed + i) for i, one in enumerate(specs)]
  expert = functools.partial(
    policies.find, "", policies.SCRIPTED, control_hz=_HERTZ.value
  )
  if own := _MAIN_TASK.value:
    tasks = choose_tasks(_TASKS.value, lfgp_dmc.task_set(own))
    return [(expert(task=own), tasks, seed)]
  tasks = choose_tasks(_TASKS.value, lfgp_dmc.ALL_TASKS)
  return [(expert(task=task), (task,), seed) for task in tasks]


def choose_tasks(requested: str, known: tuple[str, ...]) -> tuple[str, ...]:
  """The tasks of `--tasks`; raises UserError if one is not known."""
  if requested == "all":
    return known
  names = tuple(name.strip() for name in requested.split(",") if name.strip())
  unknown = [name for name in names if name not in known]
  if unknown:
    raise UserError(
      f"--tasks: unknown {', '.join(unknown)}; valid: all, or some of "
      f"{', '.join(known)}"
    )
  return tuple(dict.fromkeys(names)) or known[:1]


def _output() -> pathlib.Path | None:
  """The file the rows go to; None: only the table is printed."""
  if not _OUTPUT.value:
    if not _RUN.value:
      return None
    run = RunFolder(pathlib.Path(_RUN.value))
    # Whoever evaluates a stored policy again does not change its folder.
    keeps = run.is_run or run.evaluation.exists() or run.checkpoints.exists()
    return run.evaluation if keeps else None
  path = pathlib.Path(_OUTPUT.value) / _NAME
  if path.exists():
    raise UserError(f"{path} exists; choose another --output")
  return path


def _known(path: pathlib.Path) -> set[tuple]:
  """Step, task, episode and seed of the rows of a file that can be written."""
  files.check_writable(path)
  with command.checked_input():
    rows = evaluation_csv.read_csv(path) if path.exists() else []
  return {row[:4] for row in rows}


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
