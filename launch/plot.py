"""Draws figures from the CSV files of runs.

  python launch/plot.py --run=runs/stack_1
  python launch/plot.py --runs=runs/stack_1,runs/stack_2
  python launch/plot.py --figure=main --runs=runs/paper --output=runs/paper
  python launch/plot.py --attempts=results/few/success.csv

--run shows what one run has logged, also while it trains: success by task,
rewards, Q, discriminators' accuracies, temperatures. The picture goes into the
run's folder, where training leaves it at its end too. --runs compares runs:
--figure=runs draws every task of each algorithm and main task; its other
values are the paper's: main (all methods), multitask (every task of the
multitask methods), transfer and play. There --estimate=mean draws mean and
standard deviation of the seeds as in the paper, iqm the interquartile mean and
its stratified bootstrap interval; a CSV file beside each figure has its
numbers. --quantity=return draws returns instead of success.

--attempts draws success against the number of demonstrations from a CSV with a
row a run (method, main_task, attempts, seed, success; start, clone_success,
episodes, core_hours if they are known), and prints a table. Picture and numbers
(NAME_iqm.csv) go beside it.
"""

import functools
import itertools
import pathlib

from absl import flags

from lfgp_dmc.data import csv_files, files
from lfgp_dmc.launch import command
from lfgp_dmc.study import (
  attempt_figures,
  attempts,
  figures,
  run_picture,
  run_results,
  statistics,
)

_EACH, _BOTH = "runs", "both"

_RUN = flags.DEFINE_string("run", "", "A run's folder, drawn alone.")
_RUNS = flags.DEFINE_list(
  "runs", [], "Folders of runs, folders of such folders, or patterns of either."
)
_ATTEMPTS = flags.DEFINE_string(
  "attempts", "", "A CSV of success by number of attempts; see above."
)
_BASELINE = flags.DEFINE_string(
  "baseline", "", "With --attempts: the probability of improvement over this."
)
_OUTPUT = flags.DEFINE_string(
  "output",
  "",
  "Folder for the figures; default: runs/figures, or where --run or --attempts "
  "lie.",
)
_FIGURE = flags.DEFINE_enum(
  "figure", _EACH, [_EACH, *figures.FIGURES], "Which figure; see above."
)
_QUANTITY = flags.DEFINE_enum(
  "quantity", run_results.SUCCESS, run_results.QUANTITIES, "What is drawn."
)
_ESTIMATE = flags.DEFINE_enum(
  "estimate", _BOTH, [*statistics.ESTIMATORS, _BOTH], "How seeds become a line."
)
_FORMAT = flags.DEFINE_enum(
  "format", "png", ["png", "pdf", "svg"], "File type."
)


def main() -> None:
  """Draws, and lists the runs that a figure lacks."""
  given = [flag for flag in (_RUN, _RUNS, _ATTEMPTS) if flag.value]
  if len(given) != 1:
    raise command.UserError(
      "give one of --run=FOLDER, --runs=FOLDER,... and --attempts=FILE"
    )
  for flag, of in (
    (_FIGURE, _RUNS), (_QUANTITY, _RUNS), (_ESTIMATE, _RUNS),
    (_BASELINE, _ATTEMPTS),
  ):  # fmt: skip
    if flag.present and not of.value:
      raise command.UserError(f"--{flag.name} goes with --{of.name}")
  if _ESTIMATE.present and _FIGURE.value == _EACH:
    raise command.UserError(
      f"--estimate goes with --figure={'|'.join(figures.FIGURES)}"
    )
  with command.checked_input():
    if _RUN.value:
      _draw_one()
    elif _ATTEMPTS.value:
      _draw_attempts()
    else:
      _draw_runs()


def _draw_one() -> None:
  """What one run has logged."""
  folder = pathlib.Path(_RUN.value)
  path = (folder / run_picture.NAME).with_suffix(f".{_FORMAT.value}")
  if _OUTPUT.value:
    path = _path(folder.resolve().name)
  run_picture.draw(folder, path)
  print(path)


def _draw_attempts() -> None:
  """Success against the number of attempts."""
  source = pathlib.Path(_ATTEMPTS.value)
  folder = pathlib.Path(_OUTPUT.value or source.parent)
  path = folder / f"{source.stem}.{_FORMAT.value}"
  points = attempts.summary(attempts.read(source), _BASELINE.value)
  attempt_figures.draw(points, path)
  numbers = path.with_name(f"{source.stem}_iqm.csv")
  csv_files.write(
    numbers, attempts.Point._fields, [point._asdict() for point in points]
  )
  print(attempt_figures.table(points, _BASELINE.value))
  print(f"\n{path}\n{numbers}")


def _draw_runs() -> None:
  """Figures of many runs."""
  files.check_writable(_path("figure"))
  runs, notes = run_results.read_runs(_RUNS.value)
  notes += _draw_each(runs) if _FIGURE.value == _EACH else _draw_study(runs)
  for note in dict.fromkeys(notes):
    print(f"note: {note}")


def _draw_each(runs: list[run_results.Run]) -> list[str]:
  """A figure for each algorithm and main task."""
  notes = []
  for key, group in itertools.groupby(runs, lambda run: run[:2]):
    path = _path(*key, _QUANTITY.value)
    notes += figures.learning_curve(list(group), path, _QUANTITY.value)
    print(path)
  return notes


def _draw_study(runs: list[run_results.Run]) -> list[str]:
  """One of the paper's figures."""
  prefix = [] if _QUANTITY.value == run_results.SUCCESS else [_QUANTITY.value]
  notes = []
  for kind in statistics.ESTIMATORS:
    if _ESTIMATE.value in (kind, _BOTH):
      path = _path(*prefix, _FIGURE.value, kind)
      notes += figures.draw(_FIGURE.value, runs, path, _QUANTITY.value, kind)
      print(path)
  return notes


def _path(*words: str) -> pathlib.Path:
  folder = pathlib.Path(_OUTPUT.value or "runs/figures")
  return folder / f"{'_'.join(words)}.{_FORMAT.value}"


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
