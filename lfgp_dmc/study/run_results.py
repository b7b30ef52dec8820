"""Runs of a study, read from their `config.json` and `evaluation.csv` alone."""

import glob
import pathlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from lfgp_dmc.data import evaluation_csv, files
from lfgp_dmc.runs import run_folder
from lfgp_dmc.runs.run_folder import RunFolder

SUCCESS, RETURN = "success", "return"
QUANTITIES = (SUCCESS, RETURN)
_CLONING = ("bc", "bc_less", "multitask_bc")


class Run(NamedTuple):
  """One run: what it is, where, and its evaluations."""

  method: str  # the algorithm, or with `_play` or `_transfer` after it
  main_task: str
  seed: int
  path: pathlib.Path
  rows: list[evaluation_csv.EvaluationRow]


class Curve(NamedTuple):
  """Scores of several runs of one method."""

  steps: np.ndarray  # int [T], environment steps; [0] for cloning
  scores: np.ndarray  # float [runs, tasks, T]


def read_runs(folders: Sequence[files.Path]) -> tuple[list[Run], list[str]]:
  """Reads runs, those in folders of runs, and those that match patterns.

  Returns:
    The runs with an evaluation, sorted, and notes on those without.

  Raises:
    ValueError: a folder is no run and holds none, or two runs have the same
      method, main task and seed.
  """
  runs: dict[tuple, Run] = {}
  notes = []
  for path in _expanded(folders):
    config = read_config(path)
    evaluation = RunFolder(path).evaluation
    rows = evaluation_csv.read_csv(evaluation) if evaluation.is_file() else []
    if not rows:
      notes.append(f"{path}: nothing was evaluated yet, left out")
      continue
    main_task, seed = config["main_task"], config.get("seed", 0)
    if not isinstance(seed, int):
      raise ValueError(f"{path / run_folder.CONFIG_NAME}: seed is {seed!r}")
    run = Run(method_of(config), main_task, seed, path, rows)
    other = runs.setdefault(run[:3], run)
    if other.path.resolve() != path.resolve():
      raise ValueError(
        f"{other.path} and {path} are both {run.method} on {run.main_task} "
        f"with seed {run.seed}; give one of them"
      )
  return sorted(runs.values(), key=lambda run: run[:3]), notes


def read_config(path: pathlib.Path) -> dict[str, Any]:
  """A run's config; raises ValueError if it does not say of which run."""
  config = run_folder.read_config(path)
  for name in ("algorithm", "main_task"):
    if not isinstance(config.get(name), str):
      raise ValueError(
        f"{path / run_folder.CONFIG_NAME} is of no run: it has no {name}"
      )
  return config


def method_of(config: Mapping[str, Any]) -> str:
  """The algorithm, with `_transfer` if the run starts from another one.

  Else with `_play` if the demonstrations' folder is named so, as `stack_play`.
  """
  algorithm = config["algorithm"]
  folder = pathlib.Path(str(config.get("demonstrations") or ""))
  if config.get("transfer_from"):
    return f"{algorithm}_transfer"
  return f"{algorithm}_play" if "play" in folder.name.split("_") else algorithm


def is_cloning(method: str) -> bool:
  """Whether it takes no steps: its last evaluation is its result."""
  return method.removesuffix("_play") in _CLONING


def curve(
  strata: Sequence[tuple[Sequence[Run], str]], quantity: str = SUCCESS
) -> Curve | None:
  """Scores of one method, in one task or over several.

  Args:
    strata: for each task, the runs (one a seed) and the intention.
    quantity: "success" (share of episodes) or "return" (mean of episodes).

  Returns:
    The scores of the seeds that every task has, at the steps that all of them
    were evaluated at; None if there is no such seed or step.
  """
  by_seed = [
    {run.seed: p for run in runs if (p := _points(run, task, quantity))}
    for runs, task in strata
  ]
  seeds = sorted(set.intersection(*map(set, by_seed)))
  if not seeds:
    return None
  points = [[found[seed] for seed in seeds] for found in by_seed]
  common = set.intersection(*(set(p) for stratum in points for p in stratum))
  steps = sorted(common)
  scores = [[[p[step] for step in steps] for p in runs] for runs in points]
  return Curve(np.array(steps), np.swapaxes(scores, 0, 1)) if steps else None


def uneven(runs: Sequence[Run]) -> list[str]:
  """A note, if some seeds were evaluated for longer than others."""
  ends = {run.seed: max(row.env_step for row in run.rows) for run in runs}
  if len(set(ends.values())) < 2 or is_cloning(runs[0].method):
    return []
  listed = ", ".join(f"seed {seed} to {end}" for seed, end in ends.items())
  method, main_task, *_ = runs[0]
  return [f"{method} on {main_task}, cut to the shortest: {listed}"]


def _points(run: Run, task: str, quantity: str) -> dict[int, float]:
  """Environment step -> mean over the episodes of that evaluation."""
  values: dict[int, list[float]] = defaultdict(list)
  for row in run.rows:
    value = row.success if quantity == SUCCESS else row.episode_return
    if row.task == task and value is not None:
      values[row.env_step].append(value)
  if is_cloning(run.method) and values:
    values = {0: values[max(values)]}
  return {step: float(np.mean(episodes)) for step, episodes in values.items()}


def _expanded(patterns: Sequence[files.Path]) -> list[pathlib.Path]:
  """Runs that match, and those in folders that do; else the pattern itself."""
  found: list[pathlib.Path] = []
  for pattern in patterns:
    configs = [
      config
      for depth in ("", "*/")
      for config in glob.glob(f"{pattern}/{depth}{run_folder.CONFIG_NAME}")
    ]
    runs = [pathlib.Path(config).parent for config in sorted(configs)]
    found += runs or [pathlib.Path(pattern)]
  return list(dict.fromkeys(found))
