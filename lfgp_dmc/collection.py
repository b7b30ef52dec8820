"""Collection of demonstrations: reset-based and play-based, successes only.

Both follow the paper's section on expert data. Reset-based: a reset before
each attempt. Play-based: no reset between attempts, the next task drawn
uniformly from T_all, a reset every 360 steps. Every attempt (play: every
stretch between resets) depends on the seed and its number alone, and results
are merged by number, so the data do not depend on the number of workers.
"""

import functools
import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import tqdm

from lfgp_dmc import workers as work
from lfgp_dmc.collection_attempts import Attempt, Collector, Job, Plan, Rows
from lfgp_dmc.demonstrations import Demonstrations

COLLECTIONS = ("reset", "play")

_CHUNK = 8  # reset-based attempts a job
_MOST_FAILURES = 200  # attempts in a row, after which a task is given up


class Collected(NamedTuple):
  """One task's pairs, and how many attempts they took."""

  demonstrations: Demonstrations
  attempts: int
  successes: int


class NoSuccessError(RuntimeError):
  """The expert does not succeed at a task."""


def collect(
  plan: Plan,
  collection: str,
  tasks: Sequence[str],
  pairs: int,
  workers: int = 1,
  progress: bool = True,
  finals: int = 0,
  attempts: int = 0,
) -> dict[str, Collected]:
  """Collects exactly `pairs` pairs of each task, and `finals` on top.

  Or, if `attempts` is above 0, so many whole successful attempts of each.

  Args:
    plan: environments, actor, T_all and seed.
    collection: "reset" or "play".
    tasks: which tasks of T_all to keep the pairs of.
    pairs: N, pairs a task; the last attempt is cut there, and its rows then
      have no `is_last`. Not used with `attempts`.
    workers: processes.
    progress: whether to show a progress bar.
    finals: extra pairs a task, each the row of success of a further attempt
      and an episode of its own (the authors' later journal version).
    attempts: whole successful attempts a task; every one ends with its
      `is_last`. 0: count pairs.

  Returns:
    Task -> its pairs; the same whatever the number of workers.

  Raises:
    ValueError: an unknown collection or task, or `attempts` with `finals`.
    NoSuccessError: a task failed very often in a row.
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
  if attempts and finals:
    raise ValueError("extra finals are of attempts that are cut by pairs")
  if attempts:
    piles = {task: _AttemptPile(task, attempts) for task in tasks}
  else:
    piles = {task: _Pile(task, pairs, finals) for task in tasks}
  with tqdm.tqdm(
    total=(attempts or pairs + finals) * len(piles),
    unit="attempt" if attempts else "pair",
    disable=not progress,
  ) as bar:
    if collection == "play":
      bar.set_description("play")
      _fill(plan, piles, [None], workers, bar)
    else:
      _fill(plan, piles, [*piles], workers, bar)
  return {task: pile.collected() for task, pile in piles.items()}


def _fill(
  plan: Plan,
  piles: Mapping[str, "_Pile"],
  units: list[str | None],
  workers: int,
  bar: tqdm.tqdm,
) -> None:
  """Fills the piles, one unit of work (a task, or play) after the other."""
  open_units = _OpenUnits(units)
  make = functools.partial(Collector, plan)
  results = work.ordered(make, iter(open_units), workers)
  try:
    for unit in units:
      wanted = piles if unit is None else {unit: piles[unit]}
      if unit is not None:
        bar.set_description(unit)
      while not all(pile.is_full for pile in wanted.values()):
        of_unit, attempts = next(results)
        if of_unit != unit:  # begun before it was known that it is full
          continue
        for attempt in attempts:
          if attempt.task in wanted:
            bar.update(wanted[attempt.task].add(attempt))
      open_units.close(unit)
  finally:
    results.close()


class _OpenUnits:
  """Jobs without end: numbered chunks of the first unit not yet closed."""

  def __init__(self, units: list[str | None]):
    self._units = list(units)

  def close(self, unit: str | None) -> None:
    """Ends a unit: no more jobs of it."""
    self._units.remove(unit)

  def __iter__(self) -> Iterator[Job]:
    while self._units:
      unit = self._units[0]
      size = 1 if unit is None else _CHUNK
      for start in itertools.count(0, size):
        if not self._units or self._units[0] != unit:
          break
        yield unit, range(start, start + size)


class _Pile:
  """The pairs of one task so far."""

  _unit = "pairs"

  def __init__(self, task: str, pairs: int, finals: int):
    self._task, self._pairs, self._wanted = task, pairs, pairs + finals
    self._rows: list[Rows] = []
    self._stored = self._attempts = self._failures = 0

  @property
  def is_full(self) -> bool:
    """Are there as many pairs as wanted."""
    return self._stored >= self._wanted

  def add(self, attempt: Attempt) -> int:
    """Takes an attempt in, unless full; returns how much it added.

    Raises:
      NoSuccessError: too many failures in a row.
    """
    if self.is_full:
      return 0
    self._attempts += 1
    if attempt.rows is None:
      self._failures += 1
      if self._failures >= _MOST_FAILURES:
        raise NoSuccessError(
          f"{self._task}: {self._failures} attempts in a row failed; "
          f"{self._stored} of {self._wanted} {self._unit} collected"
        )
      return 0
    self._failures = 0
    return self._store(attempt.rows)

  def _store(self, rows: Rows) -> int:
    """Keeps what is wanted of the rows; returns how many pairs that is."""
    before = self._stored
    if before < self._pairs:
      self._rows.append(rows)
      self._stored = min(before + len(rows.action), self._pairs)
    else:
      self._rows.append(Rows(*(part[-1:] for part in rows)))
      self._stored += 1
    return self._stored - before

  def collected(self) -> Collected:
    """The pairs, the attempt that fills them cut; then the extra finals."""
    lengths = [len(rows.action) for rows in self._rows]
    is_last = np.zeros(sum(lengths), np.bool_)
    is_last[np.cumsum(lengths) - 1] = True
    episode = np.repeat(np.arange(len(lengths), dtype=np.int32), lengths)
    observation, action, next_observation = (
      np.concatenate(parts) for parts in zip(*self._rows, strict=True)
    )
    kept = self._kept(len(action))
    return Collected(
      Demonstrations(
        observation[kept],
        action[kept],
        next_observation[kept],
        episode[kept],
        is_last[kept],
      ),
      self._attempts,
      len(self._rows),
    )

  def _kept(self, rows: int) -> np.ndarray:
    """Which of the stored rows are wanted: the first, and the finals."""
    finals = self._wanted - self._pairs
    return np.r_[: self._pairs, rows - finals : rows]


class _AttemptPile(_Pile):
  """The whole attempts of one task so far."""

  _unit = "attempts"

  def __init__(self, task: str, attempts: int):
    super().__init__(task, attempts, 0)

  def _store(self, rows: Rows) -> int:
    """Keeps all rows; counts one attempt."""
    self._rows.append(rows)
    self._stored += 1
    return 1

  def _kept(self, rows: int) -> np.ndarray:
    return np.arange(rows)
