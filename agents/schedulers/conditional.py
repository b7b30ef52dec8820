"""Conditional weights: the next task given the last one (SAC-X experts).

The released code's tables by task name. Where a published table has a task
that ours lack (Unstack), its row and column are dropped and the rest of each
row is renormalised.
"""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler

RESET = "reset"  # the row of an episode's first choice
_SIXTH, _FIFTEENTH = 1 / 6, 1 / 15
_LRV = ("lift", "reach", "move_object")
_BLRV = ("bring", *_LRV)
Row = dict[str, float]


def _row(rest: Sequence[str], weight: float, **named: float) -> Row:
  """Equal weights for `rest`, and those given by name."""
  return dict.fromkeys(rest, weight) | named


def _stacking(main: str, reset: Row) -> dict[str, Row]:
  """The rows that Stack, Bring and Unstack-Stack have in common."""
  half = _row(_LRV, _SIXTH) | {main: 0.5}
  return {
    RESET: reset,
    "open_gripper": half,
    "close_gripper": half,
    "move_object": half,
    main: _row(_LRV, _FIFTEENTH, open_gripper=0.4) | {main: 0.4},
    "lift": {main: 0.5, "lift": 0.25, "move_object": 0.25},
    "reach": _row(_LRV, 0.125, close_gripper=0.125) | {main: 0.5},
  }


_INSERT_RESET = _row(_BLRV, 0.125, insert=0.5)
_MOVE_OPEN = {"lift": _SIXTH, "reach": _SIXTH, "move_object": 0.5}

# Main task -> last task -> next task -> weight.
TABLES: dict[str, dict[str, Row]] = {
  "stack": _stacking("stack", _row(_LRV, _SIXTH, stack=0.5)),
  "bring": _stacking("bring", _row(_LRV, _SIXTH, bring=0.5)),
  # Published reset row: main .35, Unstack .35, the others .1.
  "unstack_stack": _stacking(
    "unstack_stack", _row(_LRV, 0.1, unstack_stack=0.35)
  ),
  "insert": {
    RESET: _INSERT_RESET,
    "open_gripper": _INSERT_RESET,
    "close_gripper": _INSERT_RESET,
    "move_object": _INSERT_RESET,
    "insert": _row(_BLRV, 0.05, open_gripper=0.4, insert=0.4),
    "bring": _row(_BLRV, 0.05, insert=0.8),
    "lift": _row(("bring", "lift", "move_object"), _SIXTH, insert=0.5),
    "reach": _row(_BLRV, 0.1, close_gripper=0.1, insert=0.5),
  },
  # The experts' pre-training, published with Unstack beside Move-Object.
  "move_object": {
    RESET: _row(("open_gripper", *_LRV), 0.125),
    "open_gripper": _MOVE_OPEN,
    "close_gripper": _MOVE_OPEN,
    "lift": {"lift": 0.2, "move_object": 0.6},
    "reach": _row(("close_gripper", "lift", "reach"), 0.125, move_object=0.5),
    "move_object": _row(
      ("open_gripper", "reach"), 0.1, lift=0.6, move_object=0.2
    ),
  },
}


def table_for(tasks: Sequence[str]) -> np.ndarray:
  """The published table of a main task, float64 [K + 1, K]; rows sum to 1.

  A row holds the next tasks by the last one; the last row is for an episode's
  first choice.

  Raises:
    ValueError: there is no table for the main task, or not for all tasks.
  """
  main = tasks[0]
  if main not in TABLES:
    raise ValueError(
      f"no conditional table for main task {main!r}; valid: {', '.join(TABLES)}"
    )
  published = TABLES[main]
  unknown = [task for task in tasks if task not in published]
  if unknown:
    raise ValueError(
      f"the conditional table of {main!r} has no {', '.join(unknown)}"
    )
  table = np.array(
    [
      [published[last].get(task, 0.0) for task in tasks]
      for last in (*tasks, RESET)
    ]
  )
  return table / table.sum(1, keepdims=True)


class ConditionalWeighted(Scheduler):
  """Draws the next task from the row of the last one."""

  def __init__(self, tasks: Sequence[str], generator: np.random.Generator):
    """Raises ValueError as `table_for`."""
    super().__init__(generator)
    self._table = table_for(tasks)
    self._last = -1  # the reset row

  def begin_episode(self) -> None:
    """Goes back to the reset row."""
    self._last = -1

  def probabilities(self) -> np.ndarray:
    """The row of the last task, float64 [K]."""
    return self._table[self._last]

  def next_task(self) -> int:
    """Draws a task, whose row comes next."""
    self._last = super().next_task()
    return self._last
