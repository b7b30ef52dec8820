"""The paper's figures of results, from the runs of a study."""

import dataclasses
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

from lfgp_dmc.data import csv_files, files
from lfgp_dmc.study import aggregates, drawing, run_results
from lfgp_dmc.study.drawing import Panel, Style
from lfgp_dmc.study.run_results import Run
from lfgp_dmc.task_names import MAIN_TASKS, task_set

# Okabe and Ito's palette: told apart by colour-blind readers too.
_MULTITASK = {
  "lfgp": Style("LfGP", "#0072B2", "-"),
  "multitask_bc": Style("Multitask BC", "#009E73", "-"),
  "lfgp_ns": Style("LfGP-NS", "#D55E00", "-"),
}
_ALL = {
  **_MULTITASK,
  "dac": Style("DAC", "#CC79A7", ":"),
  "bc": Style("BC", "#000000", ":"),
  "bc_less": Style("BC (less data)", "#E69F00", ":"),
}
_TRANSFER = {
  "lfgp": Style("LfGP from scratch", "#0072B2", "-"),
  "lfgp_transfer": Style("LfGP, transferred", "#D55E00", "-"),
}
_PLAY = {
  "lfgp": Style("LfGP, reset-based data", "#0072B2", "-"),
  "lfgp_play": Style("LfGP, play-based data", "#D55E00", "-"),
}
COLUMNS = ("main_task", "task", "method", "env_step", "runs", "estimate",
           "middle", "low", "high")  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Plan:
  """What a figure shows: the main tasks, or a row of all tasks for each."""

  styles: Mapping[str, Style]  # method -> look, in the legend's order
  quantity: str = run_results.SUCCESS
  shows_all_tasks: bool = False


# Name -> plan; after each, the paper's label of the figure.
PLANS = {
  "main": Plan(_ALL),  # perf_results
  "multitask": Plan(_MULTITASK, shows_all_tasks=True),  # multi_perf_results
  "transfer": Plan(_TRANSFER),  # transfer_and_play_results, left
  "play": Plan(_PLAY),  # and right
  "return_main": Plan(_ALL, run_results.RETURN),  # main_return
  "return_multitask": Plan(
    _MULTITASK, run_results.RETURN, True
  ),  # multitask_return
  "return_transfer": Plan(
    _TRANSFER, run_results.RETURN
  ),  # transfer_and_play_return
  "return_play": Plan(_PLAY, run_results.RETURN),
}


def draw(
  name: str,
  runs: Sequence[Run],
  output: files.Path,
  kind: str = aggregates.MEAN,
) -> list[str]:
  """Draws one of the paper's figures, and writes its numbers beside it.

  Args:
    name: a key of `PLANS`.
    runs: of the study; those of other methods are left out.
    output: the picture; its suffix chooses the format. The numbers go to the
      same name with `.csv`.
    kind: "mean" or "iqm", see `aggregates.estimate`.

  Returns:
    Notes: which runs the figure lacks, or were cut.

  Raises:
    ValueError: there is no run to draw.
  """
  plan, output = PLANS[name], pathlib.Path(output)
  keys, grid = _panels(plan, runs, kind)
  if not any(panel.curves for row in grid for panel in row):
    raise ValueError(
      f"no run for the figure {name!r}; it shows: {', '.join(plan.styles)}"
    )
  output.parent.mkdir(parents=True, exist_ok=True)
  drawn = drawing.figure(grid, plan.styles, plan.quantity, kind)
  with files.replacing(output) as aside:
    drawn.savefig(aside, dpi=200)
  rows = [
    line
    for row, row_keys in zip(grid, keys, strict=True)
    for panel, key in zip(row, row_keys, strict=True)
    for line in _table(panel, key[0], key[1], kind)
  ]
  csv_files.write(output.with_suffix(".csv"), COLUMNS, rows)
  return _notes(plan, runs)


def _panels(plan: Plan, runs: Sequence[Run], kind: str):
  """Rows of (main task, task), and their panels."""
  grid = []
  if plan.shows_all_tasks:  # a main task without a run would be an empty row
    present = {run.main_task for run in runs if run.method in plan.styles}
    mains = [task for task in MAIN_TASKS if task in present] or MAIN_TASKS
    keys = [[(main, task) for task in task_set(main)] for main in mains]
  else:
    keys = [[(main, main) for main in MAIN_TASKS]]
  for row in keys:
    panels = [_panel(plan, runs, main, task, kind) for main, task in row]
    grid.append(panels)
  if kind == aggregates.IQM and not plan.shows_all_tasks:
    everything = _over_all_tasks(plan, grid[0])
    if everything.curves and plan.quantity == run_results.SUCCESS:
      keys[0].append(("all", "all"))
      grid[0].append(everything)
  return keys, grid


def _panel(plan: Plan, runs, main_task: str, task: str, kind: str) -> Panel:
  panel = Panel(_title(task), _title(main_task), {}, {})
  for method in plan.styles:
    own = _of(runs, method, main_task)
    curve = run_results.curve(own, task, plan.quantity)
    if curve is not None:
      panel.curves[method] = curve
      panel.estimates[method] = aggregates.estimate(curve.scores, kind)
  return panel


def _over_all_tasks(plan: Plan, panels: Sequence[Panel]) -> Panel:
  """The interquartile mean over the four main tasks, the strata."""
  together = Panel("all four", "", {}, {})
  for method in plan.styles:
    curve = run_results.across([panel.curves.get(method) for panel in panels])
    if curve is not None:
      together.curves[method] = curve
      together.estimates[method] = aggregates.estimate(
        curve.scores, aggregates.IQM
      )
  return together


def _of(runs: Sequence[Run], method: str, main_task: str) -> list[Run]:
  return [r for r in runs if (r.method, r.main_task) == (method, main_task)]


def _title(task: str) -> str:
  return "-".join(word.capitalize() for word in task.split("_"))


def _table(panel: Panel, main_task: str, task: str, kind: str) -> list[dict]:
  rows: list[dict[str, Any]] = []
  for method, curve in panel.curves.items():
    has_steps = method not in run_results.WITHOUT_STEPS
    for i, step in enumerate(curve.steps):
      values = [f"{part[i]:.6g}" for part in panel.estimates[method]]
      rows.append(
        dict(
          zip(
            COLUMNS,
            (
              main_task,
              task,
              method,
              step if has_steps else "",
              len(curve.scores),
              kind,
              *values,
            ),
            strict=True,
          )
        )
      )
  return rows


def _notes(plan: Plan, runs: Sequence[Run]) -> list[str]:
  """A line for each method that lacks main tasks, or has uneven runs."""
  notes = []
  for method, style in plan.styles.items():
    own = {main_task: _of(runs, method, main_task) for main_task in MAIN_TASKS}
    lacking = [main_task for main_task, found in own.items() if not found]
    if lacking:
      notes.append(f"no runs of {style.label} on {', '.join(lacking)}")
    notes += [
      run_results.uneven(found, task) for task, found in own.items() if found
    ]
  return [note for note in notes if note]
