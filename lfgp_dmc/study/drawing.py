"""Panels of curves, as the figures of runs and of a study are drawn."""

import pathlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib.figure
import matplotlib.ticker
import numpy as np

from lfgp_dmc.data import files
from lfgp_dmc.study import run_results
from lfgp_dmc.study.run_results import Curve
from lfgp_dmc.study.statistics import Estimate

Cell = tuple[str, str]  # main task, task
Lines = dict[tuple[Cell, str], tuple[Curve, Estimate]]  # (cell, method) -> line

STEPS = "environment steps"
# Okabe and Ito's palette, for colour-blind readers too.
COLOURS = BLUE, ORANGE, GREEN, PINK, YELLOW, SKY, BLACK = (
  "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000",
)  # fmt: skip
_MARKERS = "osD^vP*"

_UNITS = {run_results.SUCCESS: "success rate", run_results.RETURN: "return"}
_CAPTIONS = {
  "mean": "mean and standard deviation",
  "iqm": "interquartile mean and its 95 % bootstrap interval",
}


class Style(NamedTuple):
  """The look of one method."""

  label: str
  colour: str
  line: str = "-"  # dotted for single-task methods
  marker: str = ""


def styles_of(names: Iterable[str]) -> dict[str, Style]:
  """A look for each name, 49 of them unlike."""
  return {
    name: Style(
      name.replace("_", " "),
      COLOURS[i % 7],
      "--" if i // 7 % 2 else "-",
      _MARKERS[(i + i // 7) % 7],
    )
    for i, name in enumerate(names)
  }


def figure(
  cells: Sequence[Sequence[Cell]],
  lines: Lines,
  styles: Mapping[str, Style],
  quantity: str,
  kind: str,
  size: tuple[float, float],
) -> matplotlib.figure.Figure:
  """Draws rows of panels with one legend below.

  Where no method has environment steps there are bars with a dot a seed.

  Args:
    cells: rows of panels; they may differ in length.
    lines: at least one.
    styles: method -> its look, in the order of the legend.
    quantity: "success" or "return".
    kind: of the estimates, "mean" or "iqm".
    size: width and height of a panel, inches.
  """
  end = max(int(curve.steps[-1]) for curve, _ in lines.values())
  present = {method for _, method in lines}
  styles = {name: style for name, style in styles.items() if name in present}
  columns = max(map(len, cells))
  is_share = quantity == run_results.SUCCESS
  drawn, grid = panels(len(cells), columns, size, is_share)
  handles: dict[str, Any] = {}
  for row, row_cells in zip(grid, cells, strict=True):
    for axes, cell in zip(row, row_cells, strict=False):
      for i, (method, style) in enumerate(styles.items()):
        if (cell, method) in lines:
          draw = _line if end else _bar
          handles[method] = draw(axes, style, *lines[cell, method], end or i)
      finish(axes, task_title(cell[1]), end, is_share)
    for axes in row[len(row_cells) :]:
      axes.set_visible(False)
    main_task = f"{task_title(row_cells[0][0])}\n" if len(cells) > 1 else ""
    row[0].set_ylabel(main_task + _UNITS[quantity], fontsize=9)
  counts = sorted(len(curve.scores) for curve, _ in lines.values())
  seeds = " to ".join(map(str, dict.fromkeys((counts[0], counts[-1]))))
  caption = f"{_CAPTIONS[kind]} across {seeds} seeds"
  legend(drawn, handles, styles, caption if counts[-1] > 1 else "one seed")
  return drawn


def panels(
  rows: int, columns: int, size: tuple[float, float], sharey: bool = False
) -> tuple[matplotlib.figure.Figure, np.ndarray]:
  """A figure and its axes, [rows, columns], with room for a legend below."""
  width, height = size
  drawn = matplotlib.figure.Figure(
    (columns * width, rows * height + 0.6), layout="constrained"
  )
  return drawn, drawn.subplots(rows, columns, squeeze=False, sharey=sharey)


def legend(
  drawn: matplotlib.figure.Figure,
  handles: Mapping[str, Any],
  styles: Mapping[str, Style],
  title: str = "",
) -> None:
  """One legend below all panels, in the order of the styles."""
  drawn.legend(
    [handles[name] for name in styles],
    [style.label for style in styles.values()],
    loc="outside lower center",
    ncols=min(len(styles), int(drawn.get_figwidth() / 1.6)),  # inches an entry
    frameon=False,
    fontsize=9,
    title=title,
    title_fontsize=8,
  )


def save(drawn: matplotlib.figure.Figure, output: files.Path) -> None:
  """Writes the picture, whole or not at all, and the folders above it.

  Raises:
    ValueError: it cannot be written.
  """
  output = pathlib.Path(output)
  try:
    output.parent.mkdir(parents=True, exist_ok=True)
    with files.replacing(output) as aside:
      drawn.savefig(aside, dpi=200)
  except OSError as error:
    reason = error.strerror or error
    raise ValueError(f"cannot write {output}: {reason}") from error


def _line(axes, style: Style, curve: Curve, band: Estimate, end: int):
  """A line over steps; cloning, which takes none, is level."""
  steps, (middle, low, high) = curve.steps, band
  if not steps[-1]:
    steps = np.array([0, end])
    middle, low, high = (np.repeat(part, 2) for part in band)
  look = {"color": style.colour, "marker": style.marker, "clip_on": False}
  axes.fill_between(steps, low, high, color=style.colour, alpha=0.15, lw=0)
  return axes.plot(steps, middle, style.line, lw=1.6, **look)[0]


def _bar(axes, style: Style, curve: Curve, band: Estimate, position: int):
  """A bar, its band, and every seed as a dot."""
  middle, low, high = (part[-1] for part in band)
  axes.bar(position, middle, 0.62, color=style.colour, alpha=0.3)
  error = [[middle - low], [high - middle]]
  axes.errorbar(position, middle, error, color=style.colour, capsize=4, lw=1.2)
  seeds = curve.scores[..., -1].mean(axis=1)
  spread = np.linspace(-0.2, 0.2, len(seeds)) if len(seeds) > 1 else np.zeros(1)
  look = {"color": style.colour, "ms": 3.5}
  return axes.plot(position + spread, seeds, "o", **look)[0]


def finish(
  axes, title: str, end: int, is_share: bool, unit: str = STEPS
) -> None:
  """Title, grid and ticks; the x-axis goes to `end`, and is bare at 0."""
  axes.set_title(title, fontsize=10)
  axes.grid(alpha=0.25, lw=0.6)
  axes.spines[["top", "right"]].set_visible(False)
  axes.tick_params(labelsize=8, which="both")
  if is_share:
    axes.set_ylim(-0.03, 1.03)
  if end:
    axes.set_xlim(0, end)
    axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(4))
    axes.xaxis.set_major_formatter(matplotlib.ticker.EngFormatter(sep=""))
    axes.set_xlabel(unit, fontsize=8)
  else:
    axes.set_xticks([])
    axes.margins(x=0.12)


def task_title(task: str) -> str:
  """A task's name for people."""
  return "all four" if task == "all" else task.replace("_", "-").title()
