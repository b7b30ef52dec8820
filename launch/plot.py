"""Draws learning curves from the CSV files of runs.

  python launch/plot.py --runs=runs/stack_1,runs/stack_2 --output=results

Runs of the same algorithm and main task are seeds of one figure: mean, and one
standard deviation to each side.
"""

import pathlib
from collections import defaultdict

from absl import flags

from launch import command
from launch.command import UserError
from lfgp_dmc import figures, run_folder

_RUNS = flags.DEFINE_list("runs", [], "Comma-separated folders of runs.")
_OUTPUT = flags.DEFINE_string("output", "results", "Folder for the figures.")
_QUANTITY = flags.DEFINE_enum(
  "quantity", "success", ["success", "return"], "What is drawn."
)
_FORMAT = flags.DEFINE_enum(
  "format", "png", ["png", "pdf", "svg"], "Of the figures."
)


def main() -> None:
  """Draws a figure for each algorithm and main task."""
  if not _RUNS.value:
    raise UserError("--runs is missing: give the folders of one or more runs")
  groups = defaultdict(list)
  with command.checked_input():
    for name in _RUNS.value:
      config = run_folder.read_config(name)
      path = pathlib.Path(name) / "evaluation.csv"
      if not path.is_file():
        raise UserError(f"{path} is missing: nothing was evaluated yet")
      key = (config.get("algorithm", "?"), config.get("main_task", "?"))
      groups[key].append(path)
  for (algorithm, main_task), paths in groups.items():
    stem = f"{algorithm}_{main_task}_{_QUANTITY.value}.{_FORMAT.value}"
    count = f", {len(paths)} seeds" if len(paths) > 1 else ""
    title = f"{algorithm} on {main_task}{count}".replace("_", " ")
    with command.checked_input():
      output = figures.learning_curve(
        paths, pathlib.Path(_OUTPUT.value) / stem, title, _QUANTITY.value
      )
    print(output)


if __name__ == "__main__":
  command.run(main)
