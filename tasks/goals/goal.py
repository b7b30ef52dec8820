"""What makes a task: a success condition, its hold, dense reward and start."""

from collections.abc import Callable
from dataclasses import dataclass

from lfgp_dmc.tasks.goals import starts
from lfgp_dmc.tasks.snapshot import Snapshot

Terms = dict[str, float]


@dataclass(frozen=True)
class Goal:
  """One of the nine tasks.

  Conditions are of the paper's appendix "Evaluation", with numbers of the
  released code.
  """

  name: str
  condition: Callable[[Snapshot], bool]  # of success, at one instant
  dense_terms: Callable[[Snapshot], Terms]  # by name; their sum is the reward
  is_penalised_off_tray: bool = False  # see `BlockStart.penalises_green`
  hold_checks: int = 10  # consecutive 50 ms checks until it is a success
  start: starts.BlockStart = starts.APART  # of this task's episodes
