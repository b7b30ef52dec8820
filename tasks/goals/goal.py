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
    is_penalised_off_tray: whether the penalty for a green block that does not
      lie flat applies, in episodes with one (`BlockStart.penalises_green`).
    hold_checks: consecutive 50 ms checks before the condition is a success.
    start: the blocks' arrangement at the start of this task's episodes.
  """

  name: str
  condition: Callable[[Snapshot], bool]
  dense_terms: Callable[[Snapshot], Terms]
  is_penalised_off_tray: bool = False
  hold_checks: int = 10
  start: starts.BlockStart = starts.APART
