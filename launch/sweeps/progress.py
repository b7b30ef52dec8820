"""How far a run is, by what is in its folder."""

import csv
import math
import pathlib

from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.runs import run_folder
from lfgp_dmc.runs.run_folder import RunFolder

_ENDLESS = 1 << 62


def steps(folder: pathlib.Path) -> int:
  """How long a run's own config lets it be."""
  try:
    return int(run_folder.read_config(folder).get("env_steps", _ENDLESS))
  except ValueError:
    return _ENDLESS


def is_done(folder: pathlib.Path) -> bool:
  """Whether a run was evaluated at its last step; says nothing of BC."""
  step = last_success(folder)[0]
  return step != "" and int(step) >= steps(folder)


def last_success(folder: pathlib.Path) -> tuple[str, str]:
  """The last evaluation of the main task: its step, and share of successes."""
  try:
    main_task = str(run_folder.read_config(folder).get("main_task"))
    rows = evaluation_csv.read_csv(RunFolder(folder).evaluation)
  except (OSError, ValueError, csv.Error):
    return "", ""
  rows = evaluation_csv.newest(row for row in rows if row.task == main_task)
  if not rows:
    return "", ""
  rate = evaluation_csv.success_rates(rows)[main_task]
  return str(rows[0].env_step), "" if math.isnan(rate) else f"{rate:.3f}"
