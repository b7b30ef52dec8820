"""Draws figures from the CSV files of runs.

  python launch/plot.py --runs=runs/stack_1,runs/stack_2 --output=results
  python launch/plot.py --figure=main --runs=runs/paper --output=results

--figure=runs draws every task of each algorithm and main task; its other
values are the paper's: main (all methods), multitask (every task of the
multitask methods), transfer and play. There --estimate=mean draws mean and
standard deviation of the seeds as in the paper, iqm the interquartile mean and
its stratified bootstrap interval; a CSV file beside each figure has its
numbers. --quantity=return draws returns instead of success.
"""

import functools
import itertools
import pathlib

from absl import flags

from lfgp_dmc.data import files
from lfgp_dmc.launch import command
from lfgp_dmc.study import figures, run_results, statistics

_EACH, _BOTH = "runs", "both"

_RUNS = flags.DEFINE_list(
  "runs", [], "Folders of runs, folders of such folders, or patterns of either."
)
_OUTPUT = flags.DEFINE_string("output", "results", "Folder for the figures.")
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
  if not _RUNS.value:
    raise command.UserError("--runs is missing: give the folders of runs")
  files.check_writable(_path("figure"))
  with command.checked_input():
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
  return pathlib.Path(_OUTPUT.value) / f"{'_'.join(words)}.{_FORMAT.value}"


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
