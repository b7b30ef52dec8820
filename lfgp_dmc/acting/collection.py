"""Collection of demonstrations: reset-based and play-based, successes only.

Both follow the paper's section on expert data. Reset-based: a reset before
each attempt. Play-based: no reset between attempts, the next task drawn
uniformly from T_all, a reset every 360 steps. Each attempt (play: each stretch
between resets) depends on the seed and its number alone, so the data are the
same with any number of workers.
"""

import contextlib
import functools
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import tqdm

from lfgp_dmc import progress_bars
from lfgp_dmc.acting import workers as work
from lfgp_dmc.acting.attempts import Attempt, CollectionPlan, Collector, Job
from lfgp_dmc.data.demonstration_checks import COLLECTIONS
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.frame_files import FrameFile
from lfgp_dmc.types import Transition

_CHUNK = 8  # reset-based attempts a job
_MOST_FAILURES = 200  # attempts in a row, after which a task is given up


class Collected(NamedTuple):
  """One task's pairs, and how many attempts they took."""

  demonstrations: Demonstrations
  attempts: int
  successes: int


class NoSuccessError(RuntimeError):
  """The expert keeps failing at a task."""


def collect(
  plan: CollectionPlan,
  collection: str,
  tasks: Sequence[str],
  pairs: int,
  workers: int = 1,
  progress: bool = True,
  finals: int = 0,
  attempts: int = 0,
) -> dict[str, Collected]:
  """Collects exactly `pairs` pairs of each task, and `finals` on top.

  Or, with `attempts`, so many whole successful attempts instead.

  Args:
    plan: environments, actor, T_all and seed.
    collection: "reset" or "play".
    tasks: of T_all, those whose pairs are kept.
    pairs: N, pairs a task; the last attempt is cut there, and its rows then
      have no `is_last`.
    workers: processes; the pairs are the same with any number.
    progress: whether to show a progress bar.
    finals: extra pairs a task, each the row of success of a further attempt
      and an episode of its own (the authors' later journal version).
    attempts: whole successful attempts a task; 0: pairs count.

  Raises:
    ValueError: an unknown collection or task.
    NoSuccessError: 200 attempts at a task failed in a row.
  """
  if collection not in COLLECTIONS:
    raise ValueError(
      f"unknown collection {collection!r}; valid: {', '.join(COLLECTIONS)}"
    )
  for task in tasks:
    if task not in plan.tasks:
      raise ValueError(
        f"{task!r} is not a task of T_all: {', '.join(plan.tasks)}"
      )
  if attempts:
    pairs, finals = 0, attempts
  shape, whole = plan.frame_shape, attempts > 0
  piles = {task: _Pile(task, pairs, finals, whole, shape) for task in tasks}
  total = (pairs + finals) * len(piles)
  unit = "attempt" if attempts else "pair"
  with progress_bars.bar(total=total, unit=unit, show=progress) as bar:
    units: list[str | None] = [None] if collection == "play" else [*piles]
    _fill(plan, piles, units, workers, bar)
  return {task: pile.collected() for task, pile in piles.items()}


def _fill(
  plan: CollectionPlan,
  piles: Mapping[str, "_Pile"],
  units: list[str | None],
  workers: int,
  bar: tqdm.tqdm,
) -> None:
  """Fills the piles, one unit of work (a task, or play) after the other."""
  left = list(units)
  make = functools.partial(Collector, plan)
  results = work.ordered(make, _jobs(left), workers, bool(plan.frame_shape))
  with contextlib.closing(results):
    for unit in units:
      wanted = piles if unit is None else {unit: piles[unit]}
      bar.set_description_str(unit or "play")
      while not all(pile.is_full for pile in wanted.values()):
        of_unit, attempts = next(results)
        if of_unit != unit:  # begun before it was full
          continue
        for attempt in attempts:
          if attempt.task in wanted:
            bar.update(wanted[attempt.task].add(attempt))
      left.remove(unit)


def _jobs(units: list[str | None]) -> Iterator[Job]:
  """Numbered chunks of the first unit, until it is removed."""
  while units:
    unit = units[0]
    size = 1 if unit is None else _CHUNK
    for start in itertools.count(0, size):
      if not units or units[0] != unit:
        break
      yield unit, range(start, start + size)


class _Pile:
  """The pairs of one task so far."""

  def __init__(self, task: str, pairs: int, finals: int, whole: bool, shape):
    """The finals' attempts are kept whole, or their rows of success alone."""
    self._whole = whole
    self._task, self._pairs = task, pairs
    self._wanted = pairs + finals
    self._rows: list[Transition] = []
    self._is_last: list[np.ndarray] = []
    self._frames = FrameFile(shape) if shape else None
    self._stored = self._attempts = self._failures = 0

  @property
  def is_full(self) -> bool:
    """Whether all pairs are there."""
    return self._stored >= self._wanted

  def add(self, attempt: Attempt) -> int:
    """Takes an attempt in, unless full; returns how many pairs it added."""
    if self.is_full:
      return 0
    self._attempts += 1
    if attempt.rows is None:
      self._failures += 1
      if self._failures >= _MOST_FAILURES:
        raise NoSuccessError(
          f"{self._task}: {self._failures} attempts in a row failed; "
          f"{self._stored} of {self._wanted} "
          f"{'attempts' if self._whole else 'pairs'} collected"
        )
      return 0
    self._failures = 0
    length = len(attempt.rows.action)
    start, stop, added = 0, length, 1
    if self._stored < self._pairs:
      stop = added = min(length, self._pairs - self._stored)
    elif not self._whole:
      start = length - 1
    self._rows.append(Transition(*(part[start:stop] for part in attempt.rows)))
    self._is_last.append(np.arange(start, stop) == length - 1)
    if self._frames is not None:
      assert attempt.frames is not None, "the plan has frames"
      self._frames.append(attempt.frames[start : stop + 1])
    self._stored += added
    return added

  def collected(self) -> Collected:
    """The pairs, the last attempt cut; then the extra finals."""
    lengths = [len(rows.action) for rows in self._rows]
    episode = np.repeat(np.arange(len(lengths), dtype=np.int32), lengths)
    observation, action, next_observation = (
      np.concatenate(parts) for parts in zip(*self._rows, strict=True)
    )
    return Collected(
      Demonstrations(
        observation,
        action,
        next_observation,
        episode,
        np.concatenate(self._is_last),
        frames=None if self._frames is None else self._frames.mapped(),
      ),
      self._attempts,
      len(self._rows),
    )
