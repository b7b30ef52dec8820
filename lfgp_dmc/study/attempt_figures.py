"""Figure and table of success against the number of demonstrations."""

import math
from collections.abc import Sequence

import numpy as np

from lfgp_dmc.data import files
from lfgp_dmc.study import drawing, figures
from lfgp_dmc.study.attempts import ALL, Point

_LABELS = {name: style.label for name, style in figures.FIGURES["main"].items()}
_LABELS |= {
  "bc_plain": "BC without symmetries",
  "bc_6x": "BC, 6 times the attempts",
  "dac_6x": "DAC, 6 times the attempts",
}
_HEIGHT, _WIDTH, _LEAST_WIDTH = 2.5, 2.75, 7.0  # of a panel, of all: inches
_CAPTION = (
  "interquartile mean over seeds (and tasks) and its 95 % bootstrap interval; "
  "of a single seed, Wilson's interval of its resets"
)


def draw(points: Sequence[Point], output: files.Path) -> None:
  """Draws a panel for each main task, and one for all of them together.

  Raises:
    ValueError: it cannot be written.
  """
  ticks = sorted({point.attempts for point in points})
  tasks = list(dict.fromkeys(point.main_task for point in points))
  styles = drawing.styles_of(dict.fromkeys(point.method for point in points))
  width = max(_WIDTH, _LEAST_WIDTH / len(tasks))
  drawn, grid = drawing.panels(1, len(tasks), (width, _HEIGHT), sharey=True)
  handles = {}
  for axes, task in zip(grid.flat, tasks, strict=True):
    for i, (method, style) in enumerate(styles.items()):
      own = [p for p in points if (p.main_task, p.method) == (task, method)]
      own.sort(key=lambda point: point.attempts)
      middle = np.array([point.success for point in own])
      low = middle - [point.low for point in own]
      high = [point.high for point in own] - middle
      # Beside each other, since many lie at the same numbers of attempts.
      beside = 1.2 ** ((i + 0.5) / len(styles) - 0.5)
      x = [point.attempts * beside for point in own]
      handles[method] = axes.errorbar(
        x, middle, [low, high], color=style.colour, marker=style.marker,
        ls=style.line, ms=4, lw=1.3, capsize=2,
      )  # fmt: skip
    drawing.finish(axes, _title(task), 0, True)
    axes.set_xscale("log")
    axes.set_xlim(ticks[0] / 1.2, ticks[-1] * 1.2)
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("attempts a task", fontsize=8)
  grid[0, 0].set_ylabel("success rate", fontsize=9)
  styles = {
    method: style._replace(label=_label(method))
    for method, style in styles.items()
  }
  drawing.legend(drawn, handles, styles, _CAPTION)
  drawing.save(drawn, output)


def table(points: Sequence[Point], baseline: str = "") -> str:
  """A table in Markdown: methods and attempts, success by main task, hours."""
  tasks = list(dict.fromkeys(point.main_task for point in points))
  header = ["method", "attempts", *map(_title, tasks), "core hours a run"]
  known = {p.main_task for p in points if not math.isnan(p.improvement)}
  compared = (
    [ALL] if ALL in known else [task for task in tasks if task in known]
  )
  better = f"probability of improvement over {_label(baseline)}"
  is_plain = ALL in known or len(tasks) == 1
  header += [
    better if is_plain else f"{better}, {_title(task)}" for task in compared
  ]
  lines = [header, ["---"] * len(header)]
  for method, attempts in dict.fromkeys(point[:2] for point in points):
    own = {p.main_task: p for p in points if p[:2] == (method, attempts)}
    cells = [_percent(own[task][4:7]) if task in own else "" for task in tasks]
    hours = np.mean([p.core_hours for task, p in own.items() if task != ALL])
    cells.append("" if math.isnan(hours) else f"{hours:.1f}")
    cells += [_percent(own[task][8:]) if task in own else ""
              for task in compared]  # fmt: skip
    lines.append([_label(method), str(attempts), *cells])
  filled = [column for column in zip(*lines, strict=True) if any(column[2:])]
  rows = zip(*filled, strict=True)
  return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _percent(estimate: Sequence[float]) -> str:
  """`84 % (76 to 90)`; without what is not known."""
  middle, low, high = (100 * number for number in estimate)
  if math.isnan(middle):
    return ""
  interval = "" if math.isnan(low) else f" ({low:.0f} to {high:.0f})"
  return f"{middle:.0f} %{interval}"


def _label(method: str) -> str:
  """For people: `LfGP from clone` of "lfgp from clone"."""
  return " ".join(_LABELS.get(word, word) for word in method.split())


def _title(task: str) -> str:
  return "All tasks" if task == ALL else drawing.task_title(task)
