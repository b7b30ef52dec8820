"""One picture of one run, from its CSV files: while it trains, or after."""

import itertools
import math
import operator
import pathlib
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from lfgp_dmc.data import csv_files, evaluation_csv, files
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.study import drawing, run_results

NAME = "learning_curve.png"  # in the run's folder

_SIZE = (3.5, 2.5)  # of a panel, inches
_FEW = 30  # points, which get a marker each

Curves = dict[str, list[tuple[int, float]]]  # task -> (step, value)


class _Panel(NamedTuple):
  """What is logged for each task, in a column `NAME/TASK`."""

  name: str
  title: str
  unit: str
  scale: str = "linear"


_SHARES = ("success", "accuracy_expert", "accuracy_policy")  # from 0 to 1
_PANELS = (
  _Panel("success", "success in evaluation", "share of episodes"),
  _Panel("reward", "reward, mean of the batch", "reward a control step"),
  _Panel("q", "Q, mean of the batch", "discounted return"),
  _Panel("accuracy_expert", "discriminators, expert rows", "accuracy"),
  _Panel("accuracy_policy", "discriminators, the agent's rows", "accuracy"),
  _Panel("temperature", "temperature", "reward a nat of entropy", "log"),
  _Panel("loss_train", "cloning, training pairs", "loss"),
  _Panel("loss_validation", "cloning, validation pairs", "loss"),
)


def draw(path: files.Path, output: files.Path) -> None:
  """Draws what a run has logged, a panel for each quantity.

  Quantities that its algorithm does not log have no panel.

  Args:
    path: of the run.
    output: the picture; its suffix chooses the format.

  Raises:
    ValueError: it is no run, is damaged or has no rows yet; or the picture
      cannot be written.
  """
  path = pathlib.Path(path)
  config = run_results.read_config(path)
  logged = _logged(path)
  panels = [panel for panel in _PANELS if panel.name in logged]
  if not panels:
    raise ValueError(
      f"{path} has nothing to draw yet: neither evaluations nor updates"
    )
  shown = [logged[panel.name] for panel in panels]
  end = max(line[-1][0] for curves in shown for line in curves.values())
  styles = drawing.styles_of(dict.fromkeys(itertools.chain(*shown)))
  algorithm, main_task = config["algorithm"], config["main_task"]
  is_cloning = run_results.is_cloning(algorithm)
  unit = "updates" if is_cloning else drawing.STEPS
  rows = 1 if len(panels) < 4 else 2
  columns = max(2, -(-len(panels) // rows))  # room for the title
  drawn, grid = drawing.panels(rows, columns, _SIZE)
  for axes in grid.flat[len(panels) :]:
    axes.set_visible(False)
  handles = {}
  for axes, panel, curves in zip(grid.flat, panels, shown, strict=False):
    for task, points in curves.items():
      _, colour, line, marker = styles[task]
      look: dict[str, Any] = {"ms": 3.5, "lw": 1.2, "clip_on": False}
      look |= {"color": colour, "marker": marker if len(points) < _FEW else ""}
      (handles[task],) = axes.plot(*np.transpose(points), line, **look)
    drawing.finish(axes, panel.title, end, panel.name in _SHARES, unit)
    axes.set_ylabel(panel.unit, fontsize=8)
    axes.set_yscale(panel.scale)
  drawing.legend(drawn, handles, styles)
  title = f"{path.resolve().name}: {algorithm} on {main_task}, "
  title += f"seed {config.get('seed')}"
  drawn.suptitle(title, fontsize=11, parse_math=False)
  drawing.save(drawn, output)


def _logged(path: pathlib.Path) -> dict[str, Curves]:
  """What is finite of each quantity."""
  logged: dict[str, Curves] = defaultdict(lambda: defaultdict(list))
  evaluation, metrics = RunFolder(path).evaluation, RunFolder(path).metrics
  if evaluation.is_file():
    at_step = operator.attrgetter("env_step")  # later commands append rows
    rows = sorted(evaluation_csv.read_csv(evaluation), key=at_step)
    for step, group in itertools.groupby(rows, at_step):
      for task, rate in evaluation_csv.success_rates(list(group)).items():
        if math.isfinite(rate):
          logged["success"][task].append((step, rate))
  try:
    read = csv_files.read(metrics, is_log=True)[1] if metrics.is_file() else ()
    for row in read:
      step = int(row[csv_files.STEP_COLUMN])
      for column, text in row.items():
        quantity, _, task = column.partition("/")
        if task and text and math.isfinite(value := float(text)):
          logged[quantity][task].append((step, value))
  except (KeyError, ValueError) as error:
    raise ValueError(f"{metrics} is damaged: {error!r}") from None
  return logged
