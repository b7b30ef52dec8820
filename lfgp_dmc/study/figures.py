"""Learning curves of runs, and the paper's figures of results."""

import itertools
import os
from collections.abc import Mapping, Sequence
from typing import Any

from lfgp_dmc.data import csv_files, files
from lfgp_dmc.study import drawing, run_results, statistics
from lfgp_dmc.study.drawing import Cell, Lines, Style
from lfgp_dmc.study.run_results import Run
from lfgp_dmc.task_names import MAIN_TASKS, task_set

_MULTITASK = {
  "lfgp": Style("LfGP", drawing.BLUE),
  "multitask_bc": Style("Multitask BC", drawing.GREEN),
  "lfgp_ns": Style("LfGP-NS", drawing.ORANGE),
}
_SINGLE_TASK = {
  "dac": Style("DAC", drawing.PINK, ":"),
  "bc": Style("BC", drawing.BLACK, ":"),
  "bc_less": Style("BC (less data)", drawing.YELLOW, ":"),
}
_TRANSFER = {
  "lfgp": Style("LfGP from scratch", drawing.BLUE),
  "lfgp_transfer": Style("LfGP, transferred", drawing.ORANGE),
}
_PLAY = {
  "lfgp": Style("LfGP, reset-based data", drawing.BLUE),
  "lfgp_play": Style("LfGP, play-based data", drawing.ORANGE),
}
_ALL = ("all", "all")  # the cell of all main tasks together
COLUMNS = ("main_task", "task", "method", "env_step", "runs", "estimate",
           "middle", "low", "high")  # fmt: skip


# Methods of each figure, in the legend's order; after it, the paper's labels of
# success and return.
FIGURES = {
  "main": _MULTITASK | _SINGLE_TASK,  # perf_results, main_return
  "multitask": _MULTITASK,  # multi_perf_results, multitask_return
  "transfer": _TRANSFER,  # left of transfer_and_play_{results,return}
  "play": _PLAY,  # and right
}


def draw(
  name: str,
  runs: Sequence[Run],
  output: files.Path,
  quantity: str = run_results.SUCCESS,
  kind: str = "mean",
) -> list[str]:
  """Draws one of the paper's figures, and writes its numbers beside it.

  Args:
    name: a key of `FIGURES`; "multitask" has a row of all tasks for each main
      task, the others show main tasks alone.
    runs: of the study, as `read_runs` sorts them; those of other methods are
      left out.
    output: the picture; its suffix chooses the format. The numbers go to
      its name and `.csv`, such as `main.png.csv`.
    quantity: "success" or "return".
    kind: a key of `statistics.ESTIMATORS`.

  Returns:
    Notes on runs that the figure lacks, and on those that were cut.

  Raises:
    ValueError: there is no run to draw.
  """
  styles = FIGURES[name]
  runs = [run for run in runs if run.method in styles]
  cells, size = [[(main, main) for main in MAIN_TASKS]], (2.75, 2.5)
  if name == "multitask":
    present = {run.main_task for run in runs}
    mains = [main for main in MAIN_TASKS if main in present]
    cells = [[(main, task) for task in task_set(main)] for main in mains]
    size = (1.9, 1.7)
  elif kind == "iqm" and quantity == run_results.SUCCESS:
    cells[0].append(_ALL)
  lines: Lines = {}
  notes: list[str] = []
  for cell, method in itertools.product(itertools.chain(*cells), styles):
    strata = [(main, main) for main in MAIN_TASKS] if cell == _ALL else [cell]
    samples = [
      ([run for run in runs if run[:2] == (method, main)], task)
      for main, task in strata
    ]
    curve = run_results.curve(samples, quantity)
    if curve is not None:
      estimate = statistics.ESTIMATORS[kind](curve.scores)
      lines[cell, method] = curve, estimate
    if cell == _ALL:
      notes += _left_out(styles[method], samples, curve)
  if not lines:
    raise ValueError(
      f"no run for the figure {name!r}; it shows: {', '.join(styles)}"
    )
  drawing.save(
    drawing.figure(cells, lines, styles, quantity, kind, size), output
  )
  rows = _numbers(lines, kind)
  csv_files.write(f"{os.fspath(output)}.csv", COLUMNS, rows)
  return notes + _notes(styles, runs)


def learning_curve(
  runs: Sequence[Run], output: files.Path, quantity: str = run_results.SUCCESS
) -> list[str]:
  """Draws each task's success or return: mean and standard deviation of seeds.

  The runs are seeds of one method and main task. See `draw` for the rest.

  Raises:
    ValueError: no evaluation has the quantity.
  """
  method, main_task, *_ = runs[0]
  cell: Cell = (main_task, "")
  lines: Lines = {}
  tasks = dict.fromkeys(row.task for run in runs for row in run.rows)
  for task in tasks:
    curve = run_results.curve([(runs, task)], quantity)
    if curve is not None:
      lines[cell, task] = curve, statistics.mean(curve.scores)
  if not lines:
    paths = ", ".join(str(run.path) for run in runs)
    raise ValueError(f"no {quantity} in the evaluations of {paths}")
  styles, size = drawing.styles_of(tasks), (7.0, 4.0)
  drawn = drawing.figure([[cell]], lines, styles, quantity, "mean", size)
  drawn.suptitle(f"{method} on {main_task}".replace("_", " "), fontsize=11)
  drawing.save(drawn, output)
  return run_results.uneven(runs)


def _numbers(lines: Lines, kind: str) -> list[dict[str, Any]]:
  """The rows of the CSV."""
  rows = [
    (*cell, method, "" if run_results.is_cloning(method) else step,
     len(curve.scores), kind, *(f"{value:.6g}" for value in values))
    for (cell, method), (curve, estimate) in lines.items()
    for step, *values in zip(curve.steps, *estimate, strict=True)
  ]  # fmt: skip
  return [dict(zip(COLUMNS, row, strict=True)) for row in rows]


def _left_out(
  style: Style,
  strata: Sequence[tuple[Sequence[Run], str]],
  curve: run_results.Curve | None,
) -> list[str]:
  """What the panel of all tasks lacks of a method that has runs on each."""
  most = max(len(runs) for runs, _ in strata)
  if not all(runs for runs, _ in strata):
    return []  # `_notes` says so
  if curve is None:
    return [f"{style.label} has no seed and step in common of all tasks"]
  if len(curve.scores) < most:
    return [f"all four of {style.label}: {len(curve.scores)} of {most} seeds"]
  return []


def _notes(styles: Mapping[str, Style], runs: Sequence[Run]) -> list[str]:
  """What the figure lacks, method by method, and which seeds were cut."""
  notes = []
  for method, style in styles.items():
    present = {run.main_task for run in runs if run.method == method}
    lacking = [main for main in MAIN_TASKS if main not in present]
    if lacking:
      notes.append(f"no runs of {style.label} on {', '.join(lacking)}")
  for _, seeds in itertools.groupby(runs, lambda run: run[:2]):
    notes += run_results.uneven(list(seeds))
  return notes
