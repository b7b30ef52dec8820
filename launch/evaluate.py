"""Evaluates a run, a stored policy or the scripted expert.

  python launch/evaluate.py --run=runs/stack_1 --episodes=50 --tasks=all
  python launch/evaluate.py --expert=scripted --tasks=reach,lift

Every intention plays whole episodes in the main task's environment, by its
mean action; the reset of episode i depends on (--seed, i) alone.
"""

import pathlib
from collections.abc import Sequence

from absl import flags

import lfgp_dmc
from lfgp_dmc.acting import evaluation
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.launch import command, policies
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.task_names import CONTROL_RATES

_NAME = "evaluation.csv"

_RUN = flags.DEFINE_string("run", "", "A run's folder, or a policy folder.")
_EXPERT = flags.DEFINE_string("expert", "", "scripted: the scripted expert.")
_TASKS = flags.DEFINE_string(
  "tasks",
  "",
  "Comma-separated intentions, or all; default: the main task alone.",
)
_EPISODES = flags.DEFINE_integer("episodes", 50, "Episodes a task.")
_SEED = flags.DEFINE_integer("seed", 0, "Of the resets.")
_WORKERS = flags.DEFINE_integer("workers", 0, "Processes; 0: one a core.")
_MAIN_TASK = flags.DEFINE_string(
  "main_task",
  "",
  "With --expert: whose environment; default: each task in its own.",
)
_HERTZ = flags.DEFINE_integer(
  "control_hz", 20, "With --expert: 20, 10 or 5 control steps a second."
)
_OUTPUT = flags.DEFINE_string(
  "output",
  "",
  "Folder for evaluation.csv; default: the run's own, where training's rows "
  "are kept and those it does not have yet appended.",
)


def main() -> None:
  """Plays, prints the table, and writes the rows."""
  command.check_least("episodes", _EPISODES.value, 1)
  command.check_least("seed", _SEED.value, 0)
  command.check_least("workers", _WORKERS.value, 0)
  command.check_choice("control_hz", _HERTZ.value, CONTROL_RATES)
  output = _output()
  rows: list[evaluation_csv.EvaluationRow] = []
  for spec, tasks in _plan():
    rows += evaluation.evaluate(
      spec.world.factory(show_rewards=True),
      spec.make,
      tasks,
      _EPISODES.value,
      _SEED.value,
      _WORKERS.value or command.cores(),
      env_step=spec.env_step,
    )
  print(evaluation_csv.success_table(rows))
  if output is not None:
    add_rows(output, rows)
    print(f"\n{output}")


def _plan() -> list[tuple[policies.PolicySpec, tuple[str, ...]]]:
  """Policies and their tasks; an expert plays each in its own environment."""
  if _RUN.value or not _EXPERT.value:
    spec = policies.find(_RUN.value, _EXPERT.value)
    return [(spec, choose_tasks(_TASKS.value, spec.tasks))]
  command.check_choice("expert", _EXPERT.value, (policies.SCRIPTED,))
  own = _MAIN_TASK.value
  if own:
    command.check_choice("main_task", own, lfgp_dmc.ALL_TASKS)
  default = own or lfgp_dmc.MAIN_TASKS[0]
  tasks = choose_tasks(
    _TASKS.value, lfgp_dmc.task_set(own) if own else lfgp_dmc.ALL_TASKS, default
  )
  if own:
    return [(_scripted(own), tasks)]
  return [(_scripted(task), (task,)) for task in tasks]


def _scripted(task: str) -> policies.PolicySpec:
  return policies.find("", policies.SCRIPTED, task, _HERTZ.value)


def choose_tasks(
  requested: str, known: tuple[str, ...], default: str = ""
) -> tuple[str, ...]:
  """The tasks of `--tasks`.

  Raises:
    UserError: one that is not known.
  """
  if requested == "all":
    return known
  names = tuple(name.strip() for name in requested.split(",") if name.strip())
  unknown = [name for name in names if name not in known]
  if unknown:
    raise UserError(
      f"--tasks: unknown {', '.join(unknown)}; valid: all, or some of "
      f"{', '.join(known)}"
    )
  return tuple(dict.fromkeys(names)) or (default or known[0],)


def _output() -> pathlib.Path | None:
  """The file the rows go to; None: only the table is printed.

  Raises:
    UserError: the file of `--output` exists.
  """
  if not _OUTPUT.value:
    return pathlib.Path(_RUN.value) / _NAME if _RUN.value else None
  path = pathlib.Path(_OUTPUT.value) / _NAME
  if path.exists():
    raise UserError(f"{path} exists; choose another --output")
  return path


def add_rows(
  path: pathlib.Path, rows: Sequence[evaluation_csv.EvaluationRow]
) -> None:
  """Appends the rows that the file does not have; makes it if missing.

  Raises:
    UserError: the file is no evaluation.
  """
  path.parent.mkdir(parents=True, exist_ok=True)
  with command.checked_input():
    known = evaluation_csv.read_csv(path) if path.exists() else []
  keys = {row[:4] for row in known}  # env_step, task, episode, seed
  evaluation_csv.append_csv(path, [row for row in rows if row[:4] not in keys])


if __name__ == "__main__":
  command.run(main)
