"""`evaluation.csv`, its rows, and the table of success."""

import pathlib
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from lfgp_dmc.data import csv_files, files

COLUMNS = (
  "env_step",
  "task",
  "episode",
  "seed",
  "success",
  "steps_to_success",
  "return",
)


class EvaluationRow(NamedTuple):
  """One episode of one intention; the fields are the columns of the CSV."""

  env_step: int  # environment steps of training when it was evaluated
  task: str
  episode: int
  seed: int
  success: int | None  # 0 or 1; None: not observable
  steps_to_success: int | None  # control steps until the first success
  episode_return: float  # column `return`: undiscounted reward of that task


def append_csv(path: files.Path, rows: Iterable[EvaluationRow]) -> None:
  """Appends rows, as training does after each evaluation."""
  csv_files.append(path, COLUMNS, [_as_text(row) for row in rows])


def replace_csv(path: files.Path, rows: Sequence[EvaluationRow]) -> None:
  """Appends rows after dropping what the file has of the same episodes.

  Raises:
    ValueError: the file is not an evaluation's CSV; the message names it.
  """
  found = read_csv(path) if pathlib.Path(path).exists() else []
  episodes = {row[:4] for row in rows}
  kept = [row for row in found if row[:4] not in episodes]
  csv_files.write(path, COLUMNS, [_as_text(row) for row in (*kept, *rows)])


def read_csv(path: files.Path) -> list[EvaluationRow]:
  """Reads the rows back.

  Raises:
    ValueError: it is not an evaluation's CSV; the message names the file.
  """
  columns, rows = csv_files.read(path, is_log=True)
  if columns != list(COLUMNS):
    raise ValueError(
      f"{path} is no evaluation: columns {columns}, expected {list(COLUMNS)}"
    )
  try:
    return [_from_text(row) for row in rows]
  except ValueError as error:
    raise ValueError(f"{path}: {error}") from None


def newest(rows: Iterable[EvaluationRow]) -> list[EvaluationRow]:
  """The rows of the last evaluation."""
  rows = sorted(rows, key=lambda row: row.env_step)
  return [row for row in rows if row.env_step == rows[-1].env_step]


def success_rates(rows: Sequence[EvaluationRow]) -> dict[str, float]:
  """Task -> share of successful episodes; NaN if they cannot be observed."""
  rates = {}
  for task in dict.fromkeys(row.task for row in rows):
    known = [
      row.success
      for row in rows
      if row.task == task and row.success is not None
    ]
    rates[task] = float(np.mean(known)) if known else float("nan")
  return rates


def success_table(rows: Sequence[EvaluationRow]) -> str:
  """A table of one evaluation: success, episodes, mean steps, mean return."""
  rates = success_rates(rows)
  width = max([16, *(len(task) + 2 for task in rates)])
  lines = [
    f"{'task':<{width}}{'success':>9}{'episodes':>10}{'mean steps':>12}"
    f"{'mean return':>13}"
  ]
  for task, rate in rates.items():
    own = [row for row in rows if row.task == task]
    steps = [row.steps_to_success for row in own if row.steps_to_success]
    success = "-" if np.isnan(rate) else f"{rate:.1%}"
    mean_steps = f"{np.mean(steps):.1f}" if steps else "-"
    lines.append(
      f"{task:<{width}}{success:>9}{len(own):>10}{mean_steps:>12}"
      f"{np.mean([row.episode_return for row in own]):>13.2f}"
    )
  return "\n".join(lines)


def _as_text(row: EvaluationRow) -> dict[str, object]:
  values = ("" if value is None else value for value in row)
  return dict(zip(COLUMNS, values, strict=True))


def _from_text(row: dict[str, str]) -> EvaluationRow:
  success, steps = row["success"], row["steps_to_success"]
  return EvaluationRow(
    env_step=int(row["env_step"]),
    task=row["task"],
    episode=int(row["episode"]),
    seed=int(row["seed"]),
    success=int(success) if success else None,
    steps_to_success=int(steps) if steps else None,
    episode_return=float(row["return"]),
  )
