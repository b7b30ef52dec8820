"""Success against the number of demonstrations, from a CSV with a row a run."""

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lfgp_dmc.data import csv_files, files
from lfgp_dmc.study import statistics
from lfgp_dmc.study.statistics import Estimate
from lfgp_dmc.task_names import MAIN_TASKS

NEEDED = ("method", "main_task", "attempts", "seed", "success")
ALL = "all"  # main tasks together


class Result(NamedTuple):
  """How one run ended."""

  success: float  # share of its resets
  episodes: float = np.nan  # these
  core_hours: float = np.nan


class Point(NamedTuple):
  """What a method reaches with some attempts a task; NaN: not known."""

  method: str
  attempts: int
  main_task: str  # or "all"
  seeds: int
  success: float  # the interquartile mean
  low: float  # and its 95 % interval
  high: float
  core_hours: float  # mean
  improvement: float  # probability that a run beats one of the baseline
  improvement_low: float
  improvement_high: float


# (method, attempts a task, main task) -> seed -> result.
Results = dict[tuple[str, int, str], dict[int, Result]]


def read(path: files.Path) -> Results:
  """Reads a CSV with the columns `NEEDED`.

  A row whose column `start` says clone is of the method "lfgp from clone", say,
  and its column `clone_success` of the method "clone of lfgp". `episodes` and
  `core_hours` may be there too.

  Raises:
    ValueError: there is no row, a column is missing, a number is none, or a
      run is there twice.
  """
  columns, rows = csv_files.read(path)
  if lacking := [name for name in NEEDED if name not in columns]:
    raise ValueError(f"{path} has no column {', '.join(lacking)}")
  results: Results = defaultdict(dict)
  for line, row in enumerate(rows, 2):
    from_clone = " from clone" if row.get("start") == "clone" else ""
    found = {row["method"] + from_clone: row["success"]}
    if row.get("clone_success"):
      found[f"clone of {row['method']}"] = row["clone_success"]
    try:
      seed = int(row["seed"])
      episodes, hours = (
        float(row.get(name) or "nan") for name in ("episodes", "core_hours")
      )
      attempts, task = int(row["attempts"]), row["main_task"].strip()
      if attempts < 1:
        raise ValueError(f"attempts is {attempts}; valid: 1 or more")
      if task == ALL:
        raise ValueError(f"main_task is {ALL}; valid: a task")
      is_told = not np.isnan(episodes)
      if is_told and not (episodes >= 1 and episodes % 1 == 0):
        raise ValueError(f"episodes is {episodes}; valid: 1 or more")
      for method, success in found.items():
        seeds = results[method.strip(), attempts, task]
        if seed in seeds:
          raise ValueError(f"seed {seed} of {method} is there twice")
        if not 0 <= float(success) <= 1:
          raise ValueError(f"success is {success}; valid: 0 to 1")
        seeds[seed] = Result(float(success), episodes, hours)
        hours = np.nan  # of cloning: not recorded
    except ValueError as error:
      raise ValueError(f"{path}, line {line}: {error}") from None
  if not results:
    raise ValueError(f"{path} has no rows yet")
  return results


def summary(results: Results, baseline: str = "") -> list[Point]:
  """Interquartile means over seeds: of each main task, and of all together.

  All are together where a method has seeds in common in each main task.

  Args:
    results: as `read` returns them.
    baseline: a method, for each other one's probability of improvement over it
      with as many attempts.

  Raises:
    ValueError: there is no such baseline.
  """
  methods, _, tasks = (
    list(dict.fromkeys(part)) for part in zip(*results, strict=True)
  )
  if baseline and baseline not in methods:
    raise ValueError(f"no method {baseline!r}; valid: {', '.join(methods)}")
  tasks.sort(key=lambda task: [*MAIN_TASKS, task].index(task))
  strata = {task: [task] for task in tasks}
  if len(tasks) > 1:
    strata[ALL] = tasks
  points = []
  keys = dict.fromkeys(key[:2] for key in results)
  for method, attempts in sorted(keys, key=lambda key: key[1]):
    for name, together in strata.items():
      runs = _runs(results, method, attempts, together)
      if not runs.size:
        continue
      scores, hours = runs[..., :1], runs[..., 2].mean()
      estimate = _known(statistics.interquartile_mean(scores), len(runs))
      if runs.shape[:2] == (1, 1) and np.isfinite(runs[0, 0, 1]):
        estimate = statistics.share(runs[0, 0, 0], int(runs[0, 0, 1]))
      improvement = Estimate(*np.full((3, 1), np.nan))
      others = _runs(results, baseline, attempts, together)
      if others.size and method != baseline:
        improvement = _known(
          statistics.probability_of_improvement(scores, others[..., :1]),
          min(len(runs), len(others)),
        )
      numbers = *np.ravel(estimate), hours, *np.ravel(improvement)
      rounded = (round(float(number), 4) for number in numbers)
      points.append(Point(method, attempts, name, len(runs), *rounded))
  return points


def _known(estimate: Estimate, seeds: int) -> Estimate:
  """An estimate, of a single seed without an interval."""
  if seeds > 1:
    return estimate
  return Estimate(estimate.middle, *np.full((2, 1), np.nan))


def _runs(
  results: Results, method: str, attempts: int, tasks: Sequence[str]
) -> np.ndarray:
  """Results of the seeds that every task has, float [R, K, 3]."""
  found = [results.get((method, attempts, task), {}) for task in tasks]
  seeds = sorted(set.intersection(*map(set, found)))
  return np.array([[by_seed[seed] for by_seed in found] for seed in seeds])
