"""Figures from the CSV files alone."""

import pathlib
from collections import defaultdict
from collections.abc import Callable, Sequence

import matplotlib.figure
import matplotlib.ticker
import numpy as np

from lfgp_dmc.data import evaluation_csv, files
from lfgp_dmc.data.evaluation_csv import EvaluationRow

# Okabe and Ito's palette: told apart by colour-blind readers too.
_COLOURS = (
  "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000",
  "#999933", "#882255",
)  # fmt: skip
_MARKERS = "osD^vP*Xh"

Curves = dict[str, dict[int, list[float]]]  # task -> env_step -> one per run


def learning_curve(
  evaluations: Sequence[files.Path],
  output: files.Path,
  title: str = "",
  quantity: str = "success",
) -> pathlib.Path:
  """Draws each task's success (or return) against environment steps.

  Args:
    evaluations: `evaluation.csv` of one run, or of several seeds: then the
      line is their mean and the band one standard deviation to each side.
    output: the picture's path; its suffix chooses the format (png, pdf, svg).
    title: above the axes.
    quantity: "success" (share of episodes) or "return".

  Returns:
    The path of the picture.

  Raises:
    ValueError: no evaluation holds a row, or the quantity is unknown.
  """
  curves = _curves(evaluations, quantity)
  if not curves:
    raise ValueError(
      f"no evaluation rows in {', '.join(str(path) for path in evaluations)}"
    )
  figure = matplotlib.figure.Figure(figsize=(7, 4.2), layout="constrained")
  axes = figure.subplots()
  for i, (task, points) in enumerate(curves.items()):
    _draw(axes, task, points, _COLOURS[i % len(_COLOURS)], _MARKERS[i % 9])
  axes.set_xlabel("environment steps")
  axes.xaxis.set_major_formatter(matplotlib.ticker.EngFormatter(sep=""))
  if quantity == "success":
    axes.set_ylabel("success (share of episodes)")
    axes.set_ylim(-0.03, 1.03)
  else:
    axes.set_ylabel("mean episode return")
  if title:
    axes.set_title(title)
  axes.grid(alpha=0.3)
  axes.spines[["top", "right"]].set_visible(False)
  figure.legend(loc="outside right upper", frameon=False)
  output = pathlib.Path(output)
  output.parent.mkdir(parents=True, exist_ok=True)
  with files.replacing(output) as aside:
    figure.savefig(aside, dpi=150)
  return output


def _draw(axes, task: str, points: dict[int, list[float]], colour, marker):
  steps = sorted(points)
  mean = np.array([np.mean(points[step]) for step in steps])
  deviation = np.array([np.std(points[step]) for step in steps])
  axes.plot(
    steps,
    mean,
    color=colour,
    marker=marker,
    markersize=5,
    linewidth=1.8,
    label=task.replace("_", " "),
    clip_on=False,
  )
  if max(len(values) for values in points.values()) > 1:
    axes.fill_between(
      steps, mean - deviation, mean + deviation, color=colour, alpha=0.18
    )


def _curves(evaluations: Sequence[files.Path], quantity: str) -> Curves:
  summaries: dict[str, Callable[[Sequence[EvaluationRow]], dict]] = {
    "success": evaluation_csv.success_rates,
    "return": evaluation_csv.mean_returns,
  }
  if quantity not in summaries:
    raise ValueError(
      f"unknown quantity {quantity!r}; valid: {', '.join(summaries)}"
    )
  curves: Curves = {}
  for path in evaluations:
    by_step = defaultdict(list)
    for row in evaluation_csv.read_csv(path):
      by_step[row.env_step].append(row)
    for step, rows in by_step.items():
      for task, value in summaries[quantity](rows).items():
        curves.setdefault(task, {}).setdefault(step, []).append(value)
  return curves
