"""Panels of curves, as the figures of a study are drawn."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.figure
import matplotlib.ticker
import numpy as np

from lfgp_dmc.study import aggregates, run_results
from lfgp_dmc.study.aggregates import Estimate
from lfgp_dmc.study.run_results import Curve

_UNITS = {run_results.SUCCESS: "success rate", run_results.RETURN: "return"}
_CAPTIONS = {
  aggregates.MEAN: "mean and standard deviation",
  aggregates.IQM: "interquartile mean and its 95 % bootstrap interval",
}


@dataclasses.dataclass(frozen=True)
class Style:
  """How a method looks."""

  label: str
  colour: str
  line: str  # solid for multitask methods, dotted for single-task ones


@dataclasses.dataclass
class Panel:
  """One pair of axes: a curve a method, in the order of the legend."""

  title: str
  row: str  # name of its row, where there are several
  curves: dict[str, Curve]
  estimates: dict[str, Estimate]


def figure(
  grid: Sequence[Sequence[Panel]],
  styles: Mapping[str, Style],
  quantity: str,
  kind: str,
) -> matplotlib.figure.Figure:
  """Draws rows of panels with one legend below.

  Args:
    grid: rows of panels; they may differ in length.
    styles: method -> how it looks, in the order of the legend.
    quantity: "success" or "return".
    kind: of the estimates, "mean" or "iqm".

  Returns:
    The figure; where no method has environment steps, bars with a dot a seed.
  """
  columns, is_large = max(len(row) for row in grid), len(grid) > 1
  width, height = (1.9, 1.6) if is_large else (2.75, 2.5)  # inches a panel
  drawn = matplotlib.figure.Figure(
    figsize=(columns * width, len(grid) * height + 0.6), layout="constrained"
  )
  is_share = quantity == run_results.SUCCESS
  axes = drawn.subplots(len(grid), columns, squeeze=False, sharey=is_share)
  end = _last_step(grid)
  lines: dict[str, Any] = {}
  present = {method for row in grid for panel in row for method in panel.curves}
  styles = {name: look for name, look in styles.items() if name in present}
  for row, panels in zip(axes, grid, strict=True):
    for one, panel in zip(row, panels, strict=False):
      lines |= _fill(one, panel, styles, end)
      _finish(one, panel, end, is_share, is_large)
    for one in row[len(panels) :]:
      one.set_visible(False)
    name = f"{panels[0].row}\n" if is_large else ""
    row[0].set_ylabel(name + _UNITS[quantity], fontsize=9)
  drawn.legend(
    [lines[method] for method in styles],
    [look.label for look in styles.values()],
    loc="outside lower center",
    ncols=len(styles),
    frameon=False,
    fontsize=9,
    title=_caption(grid, kind)
    + (", over environment steps" if is_large else ""),
    title_fontsize=8,
  )
  return drawn


def _caption(grid: Sequence[Sequence[Panel]], kind: str) -> str:
  counts = [
    len(curve.scores)
    for row in grid
    for panel in row
    for curve in panel.curves.values()
  ]
  least, most = min(counts), max(counts)
  seeds = f"{most} seed{'s' if most > 1 else ''}"
  if least < most:
    seeds = f"{least} to {seeds}"
  return f"{_CAPTIONS[kind]} across {seeds}"


def _last_step(grid: Sequence[Sequence[Panel]]) -> int:
  return max(
    (
      int(curve.steps[-1])
      for row in grid
      for panel in row
      for curve in panel.curves.values()
      if len(curve.steps)
    ),
    default=0,
  )


def _fill(axes, panel: Panel, styles: Mapping[str, Style], end: int) -> dict:
  """Draws a panel's methods; returns method -> its handle for the legend."""
  lines = {}
  for position, (method, style) in enumerate(styles.items()):
    if method not in panel.curves:
      continue
    curve, band = panel.curves[method], panel.estimates[method]
    if end:
      lines[method] = _line(axes, style, method, curve, band, -position, end)
    else:
      lines[method] = _bar(axes, style, curve, band, position)
  return lines


def _line(axes, style: Style, method, curve: Curve, band: Estimate, order, end):
  """A line over steps; behaviour cloning, which takes none, is level."""
  steps: np.ndarray = curve.steps
  if method in run_results.WITHOUT_STEPS:
    steps = np.array([0, end])
    band = Estimate(*(np.repeat(part, 2) for part in band))
  colour = style.colour
  axes.fill_between(steps, band.low, band.high, color=colour, alpha=0.15, lw=0)
  (line,) = axes.plot(
    steps, band.middle, style.line, color=colour, lw=1.6, zorder=10 + order
  )
  return line


def _bar(axes, style: Style, curve: Curve, band: Estimate, position: int):
  """Where nothing takes steps: a bar, its band, and every seed as a dot."""
  middle, low, high = (part[-1] for part in band)
  axes.bar(position, middle, 0.62, color=style.colour, alpha=0.3)
  axes.errorbar(
    position,
    middle,
    [[middle - low], [high - middle]],
    color=style.colour,
    capsize=4,
    lw=1.2,
  )
  seeds = curve.scores[..., -1].mean(axis=1)
  spread = np.linspace(-0.2, 0.2, len(seeds)) if len(seeds) > 1 else [0.0]
  (dots,) = axes.plot(
    position + np.asarray(spread), seeds, "o", ms=3.5, color=style.colour
  )
  return dots


def _finish(axes, panel: Panel, end: int, is_share: bool, is_large: bool):
  axes.set_title(panel.title, fontsize=9 if is_large else 10)
  axes.grid(alpha=0.25, lw=0.6)
  axes.spines[["top", "right"]].set_visible(False)
  axes.tick_params(labelsize=7 if is_large else 8)
  if is_share:
    axes.set_ylim(-0.03, 1.03)
  if end:
    axes.set_xlim(0, end)
    axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(4))
    axes.xaxis.set_major_formatter(matplotlib.ticker.EngFormatter(sep=""))
    if not is_large:
      axes.set_xlabel("environment steps", fontsize=9)
  else:
    axes.set_xticks([])
    axes.margins(x=0.12)
  if not panel.curves:
    axes.text(0.5, 0.5, "no runs", transform=axes.transAxes, ha="center")
