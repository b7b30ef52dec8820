"""What makes a task: a success condition, its hold, dense reward and start."""

from collections.abc import Callable
from dataclasses import dataclass

from lfgp_dmc.tasks.goals import starts
from lfgp_dmc.tasks.snapshot import Snapshot

Terms = dict[str, float]


@dataclass(frozen=True)
class Goal:
  """One of the nine tasks.

  Attributes:
    name: the task's name.
    condition: the success condition at one instant (appendix "Evaluation" of
      the paper; numbers of the released code).
    dense_terms: named terms of the dense reward, whose sum is the reward.
    is_penalised_off_tray: whether the reward falls while green does not lie
      flat, in episodes with such a penalty (`BlockStart.penalises_green`).
    hold_checks: consecutive 50 ms checks before the condition is a success.
    start: where the blocks are when an episode of this task starts.
  """

  name: str
  condition: Callable[[Snapshot], bool]
  dense_terms: Callable[[Snapshot], Terms]
  is_penalised_off_tray: bool = False
  hold_checks: int = 10
  start: starts.BlockStart = starts.APART
