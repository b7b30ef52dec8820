"""Draws figures from the CSV files of runs, and the table of datasets.

  python launch/plot.py --runs=runs/stack_1,runs/stack_2 --output=results
  python launch/plot.py --figure=main --runs=runs/paper --output=results
  python launch/plot.py --figure=datasets --datasets='data/*' --output=results

--figure=runs draws every task of each algorithm and main task; its other
values are the paper's: main (success of all methods), multitask (every task of
the multitask methods), transfer, play, the same with return_ before them, and
datasets (the table of shared demonstrations, as CSV and Markdown). Seeds are
one line: --estimate=mean draws mean and standard deviation as in the paper,
iqm the interquartile mean and its stratified bootstrap interval, both both.
The numbers of each figure are in the CSV file beside it.
"""

import glob
import pathlib
from collections import defaultdict
from collections.abc import Sequence

from absl import flags

from lfgp_dmc import dataset_table
from lfgp_dmc.data import csv_files, files
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.runs import run_folder
from lfgp_dmc.study import aggregates, figures, learning_curve, run_results

_EACH, _DATASETS, _BOTH = "runs", "datasets", "both"

_RUNS = flags.DEFINE_list(
  "runs",
  [],
  "Comma-separated folders of runs, folders of such folders, or patterns.",
)
_OUTPUT = flags.DEFINE_string("output", "results", "Folder for the figures.")
_FIGURE = flags.DEFINE_enum(
  "figure",
  _EACH,
  [_EACH, *figures.PLANS, _DATASETS],
  "Which figure; see above.",
)
_QUANTITY = flags.DEFINE_enum(
  "quantity",
  run_results.SUCCESS,
  run_results.QUANTITIES,
  "What --figure=runs draws.",
)
_ESTIMATE = flags.DEFINE_enum(
  "estimate", _BOTH, [*aggregates.ESTIMATES, _BOTH], "How seeds become a line."
)
_FORMAT = flags.DEFINE_enum(
  "format", "png", ["png", "pdf", "svg"], "Of the figures."
)
_DATASET_FOLDERS = flags.DEFINE_list(
  "datasets", [], "Folders, or patterns, of --figure=datasets."
)


def main() -> None:
  """Draws, and says which runs a figure lacks."""
  output = pathlib.Path(_OUTPUT.value)
  if _FIGURE.value == _DATASETS:
    _write_dataset_table(output)
    return
  folders = _matching(_RUNS.value, "runs", "the folders of one or more runs")
  if _FIGURE.value == _EACH:
    _draw_each(folders, output)
  else:
    _draw_study(folders, output)


def _draw_each(folders: Sequence[str], output: pathlib.Path) -> None:
  """A figure for each algorithm and main task."""
  groups = defaultdict(list)
  with command.checked_input():
    for folder in run_results.expanded(folders):
      config = run_folder.read_config(folder)
      path = folder / "evaluation.csv"
      if not path.is_file():
        raise UserError(f"{path} is missing: nothing was evaluated yet")
      key = (run_results.method_of(config), config.get("main_task", "?"))
      groups[key].append(path)
  for (method, main_task), paths in groups.items():
    stem = f"{method}_{main_task}_{_QUANTITY.value}.{_FORMAT.value}"
    count = f", {len(paths)} seeds" if len(paths) > 1 else ""
    title = f"{method} on {main_task}{count}".replace("_", " ")
    with command.checked_input():
      print(
        learning_curve.learning_curve(
          paths, output / stem, title, _QUANTITY.value
        )
      )


def _draw_study(folders: Sequence[str], output: pathlib.Path) -> None:
  """One of the paper's figures."""
  with command.checked_input():
    runs, notes = run_results.read_runs(folders)
  kinds = [_ESTIMATE.value]
  if _ESTIMATE.value == _BOTH:
    kinds = list(aggregates.ESTIMATES)
  for kind in kinds:
    path = output / f"{_FIGURE.value}_{kind}.{_FORMAT.value}"
    with command.checked_input():
      notes += figures.draw(_FIGURE.value, runs, path, kind)
    print(path)
  for note in dict.fromkeys(notes):
    print(f"note: {note}")


def _write_dataset_table(output: pathlib.Path) -> None:
  folders = _matching(_DATASET_FOLDERS.value, "datasets", "dataset folders")
  with command.checked_input():
    rows = dataset_table.rows([dataset_table.read(path) for path in folders])
  text = dataset_table.markdown(rows)
  output.mkdir(parents=True, exist_ok=True)
  csv_files.write(output / "datasets.csv", dataset_table.COLUMNS, rows)
  with files.replacing(output / "datasets.md") as aside:
    aside.write_text(text, encoding="utf-8")
  print(f"{text}\n{output / 'datasets.csv'}\n{output / 'datasets.md'}")


def _matching(patterns: Sequence[str], flag: str, wanted: str) -> list[str]:
  """The folders that are named or match; a name without a match stays."""
  if not patterns:
    raise UserError(f"--{flag} is missing: give {wanted}")
  found: list[str] = []
  for pattern in patterns:
    found += sorted(p for p in glob.glob(pattern) if pathlib.Path(p).is_dir())
    if not glob.glob(pattern):
      found.append(pattern)
  return list(dict.fromkeys(found))


if __name__ == "__main__":
  command.run(main)
