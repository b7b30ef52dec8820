"""The runs of a study, read from `config.json` and `evaluation.csv` alone.

Runs are grouped by method and main task; each seed is one row of scores.
"""

import pathlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import h5py
import numpy as np

from lfgp_dmc.data import demonstrations, evaluation_csv, files
from lfgp_dmc.runs import run_folder

SUCCESS, RETURN = "success", "return"
QUANTITIES = (SUCCESS, RETURN)
# Methods without environment steps: their last evaluation is their result.
WITHOUT_STEPS = ("bc", "bc_less", "multitask_bc")


# (quantity, task) -> environment step -> score
Scores = dict[tuple[str, str], dict[int, float]]


class Run(NamedTuple):
  """One run: what it is, where, and its scores."""

  method: str  # the algorithm, or with `_play` or `_transfer` after it
  main_task: str
  seed: int
  path: pathlib.Path
  scores: Scores


class Curve(NamedTuple):
  """Scores of several seeds of one method."""

  steps: np.ndarray  # int [T], environment steps
  scores: np.ndarray  # float [runs, tasks, T]


def read_runs(folders: Sequence[files.Path]) -> tuple[list[Run], list[str]]:
  """Reads which runs there are.

  Args:
    folders: runs, or folders of runs.

  Returns:
    The runs with an evaluation, sorted, and notes on what was left out.

  Raises:
    ValueError: a folder is no run and holds none, or two runs are the same
      method, main task and seed.
  """
  runs: dict[tuple, Run] = {}
  notes = []
  for path in expanded(folders):
    config = run_folder.read_config(path)
    if not (path / "evaluation.csv").is_file():
      notes.append(f"{path}: nothing was evaluated yet, left out")
      continue
    run = Run(
      method_of(config),
      str(config.get("main_task", "?")),
      int(config.get("seed", 0)),
      path,
      _scores(path / "evaluation.csv"),
    )
    other = runs.setdefault(run[:3], run)
    if other.path.resolve() != path.resolve():
      raise ValueError(
        f"{other.path} and {path} are both {run.method} on {run.main_task} "
        f"with seed {run.seed}; give one of them"
      )
  return sorted(runs.values(), key=lambda run: run[:3]), notes


def method_of(config: Mapping[str, Any]) -> str:
  """The method that a run's config describes.

  Returns:
    The algorithm; after it `_transfer` if a field about transfer is set,
    else `_play` if the demonstrations were collected by play.
  """
  algorithm = str(config.get("algorithm", "?"))
  agent = config.get("agent")
  fields = {**config, **(agent if isinstance(agent, Mapping) else {})}
  # The run or folder it starts from, not numbers such as transfer_updates.
  if any("transfer" in k and v and isinstance(v, str)
         for k, v in fields.items()):  # fmt: skip
    return f"{algorithm}_transfer"
  shown = config.get("demonstrations")
  if shown and _is_play(pathlib.Path(str(shown))):
    return f"{algorithm}_play"
  return algorithm


def curve(
  runs: Sequence[Run], task: str, quantity: str = SUCCESS
) -> Curve | None:
  """One task's score in the runs of one method and main task.

  Args:
    runs: one a seed.
    task: the intention.
    quantity: "success" (share of episodes) or "return" (mean of episodes).

  Returns:
    The scores at the steps that all the seeds have been evaluated at (of
    methods without environment steps: the last alone); None if no run has
    evaluated the task.

  Raises:
    ValueError: an unknown quantity, or a damaged CSV.
  """
  if quantity not in QUANTITIES:
    raise ValueError(
      f"unknown quantity {quantity!r}; valid: {', '.join(QUANTITIES)}"
    )
  found = []
  for run in runs:
    points = run.scores.get((quantity, task), {})
    if run.method in WITHOUT_STEPS and points:
      points = {0: points[max(points)]}
    if points:
      found.append(points)
  if not found:
    return None
  common = set.intersection(*map(set, found))
  steps = np.array(sorted(common), np.int64)
  scores = [[points[int(step)] for step in steps] for points in found]
  return Curve(steps, np.array(scores)[:, None])


def across(curves: Sequence[Curve | None]) -> Curve | None:
  """Several tasks' curves of one method as one; None unless all fit.

  Args:
    curves: one a task; they fit if none is missing and all have as many seeds.
  """
  known = [one for one in curves if one is not None]
  if len(known) < len(curves) or len({len(one.scores) for one in known}) != 1:
    return None
  steps = known[0].steps
  for one in known[1:]:
    steps = np.intersect1d(steps, one.steps)
  parts = [one.scores[..., np.isin(one.steps, steps)] for one in known]
  return Curve(steps, np.concatenate(parts, axis=1))


def uneven(runs: Sequence[Run], task: str) -> str:
  """Says which seeds were evaluated for longer than others; "" if none."""
  ends = {
    run.seed: max(run.scores.get((RETURN, task), {}), default=0)
    for run in runs
    if run.method not in WITHOUT_STEPS
  }
  if len(set(ends.values())) < 2:
    return ""
  listed = ", ".join(f"seed {seed} to {end}" for seed, end in ends.items())
  return (
    f"{runs[0].method} on {runs[0].main_task}, cut to the shortest: {listed}"
  )


def expanded(folders: Sequence[files.Path]) -> list[pathlib.Path]:
  """Runs themselves, and the runs inside folders that are none."""
  found = []
  for folder in map(pathlib.Path, folders):
    inside = sorted(
      path.parent for path in folder.glob(f"*/{run_folder.CONFIG_NAME}")
    )
    is_run = (folder / run_folder.CONFIG_NAME).is_file()
    found += inside if inside and not is_run else [folder]
  return found


def _scores(path: pathlib.Path) -> Scores:
  by_step: dict[int, list] = {}
  for row in evaluation_csv.read_csv(path):
    by_step.setdefault(row.env_step, []).append(row)
  scores: Scores = {}
  for step, rows in by_step.items():
    for quantity, summary in (
      (SUCCESS, evaluation_csv.success_rates(rows)),
      (RETURN, evaluation_csv.mean_returns(rows)),
    ):
      for task, value in summary.items():
        if np.isfinite(value):
          scores.setdefault((quantity, task), {})[step] = value
  return scores


def _is_play(folder: pathlib.Path) -> bool:
  """By the files' own attribute, or where they are gone by the name."""
  for path in folder.glob(f"*{demonstrations.SUFFIX}"):
    try:
      with h5py.File(path, "r") as file:
        return file.attrs.get("collection") == "play"
    except OSError:  # damaged: that is for whoever uses it to say
      break
  return "play" in folder.name.split("_")
