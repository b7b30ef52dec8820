"""Open-Gripper and Close-Gripper: command the fingers, slowly, near a block."""

import math

from lfgp_dmc.tasks import predicates
from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot


def is_opening(state: Snapshot) -> bool:
  """a_g < 0, a block within 10 cm, the TCP slower than 8 cm/s."""
  return state.action[3] < 0.0 and _is_calm(state)


def is_closing(state: Snapshot) -> bool:
  """a_g > 0, a block within 10 cm, the TCP slower than 8 cm/s."""
  return state.action[3] > 0.0 and _is_calm(state)


def _is_calm(state: Snapshot) -> bool:
  return predicates.is_slow(state) and predicates.is_near_a_block(state)


def open_terms(state: Snapshot) -> Terms:
  """1 for the command, less half the movement's size; near a block only."""
  return _terms(state, state.action[3] < 0.0)


def close_terms(state: Snapshot) -> Terms:
  """1 for the command, less half the movement's size; near a block only."""
  return _terms(state, state.action[3] > 0.0)


def _terms(state: Snapshot, is_commanded: bool) -> Terms:
  near = 1.0 if predicates.is_near_a_block(state) else 0.0
  return {
    "command": near * float(is_commanded),
    "movement": -0.5 * near * math.hypot(*state.action[:3]),
    "limits": terms.limits(state),
  }


OPEN_GRIPPER = Goal("open_gripper", is_opening, open_terms)
CLOSE_GRIPPER = Goal("close_gripper", is_closing, close_terms)
