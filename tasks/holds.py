"""Success is a condition held long enough, then latched for the episode."""

from collections.abc import Iterable, Mapping

from lfgp_dmc.tasks.goals import Goal


class Holds:
  """Counts consecutive checks of every task's condition."""

  def __init__(self, goals: Mapping[str, Goal]):
    self._needed = [goal.hold_checks for goal in goals.values()]
    self.clear()

  def clear(self) -> None:
    """Restarts every hold and forgets every success."""
    self._held = [0] * len(self._needed)
    self.successes = [False] * len(self._needed)

  def check(self, conditions: Iterable[bool]) -> None:
    """One check, every 50 ms; `conditions` in the order of the goals."""
    for index, holds in enumerate(conditions):
      if not holds:
        self._held[index] = 0
        continue
      self._held[index] += 1
      if self._held[index] >= self._needed[index]:
        self.successes[index] = True
