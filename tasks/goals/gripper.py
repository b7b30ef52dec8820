"""Open-Gripper and Close-Gripper: command the fingers, slowly, near a block."""

import functools
import math

from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot


def is_commanded(state: Snapshot, sign: float) -> bool:
  """a_g of that sign, a block within 10 cm, the TCP slower than 8 cm/s."""
  is_slow = state.tcp_speed < 0.08
  return sign * state.action[3] > 0.0 and is_slow and _is_near_a_block(state)


def dense_terms(state: Snapshot, sign: float) -> Terms:
  """1 for the command minus half the movement's size, near a block only."""
  near = 1.0 if _is_near_a_block(state) else 0.0
  return {
    "command": near * float(sign * state.action[3] > 0.0),
    "movement": -0.5 * near * math.hypot(*state.action[:3]),
    "limits": terms.limits(state),
  }


def _is_near_a_block(state: Snapshot) -> bool:
  nearest = min(math.dist(state.tcp, xyz) for xyz in (state.blue, state.green))
  return nearest <= terms.NEAR


def _goal(name: str, sign: float) -> Goal:
  return Goal(
    name,
    functools.partial(is_commanded, sign=sign),
    functools.partial(dense_terms, sign=sign),
  )


OPEN_GRIPPER = _goal("open_gripper", -1.0)
CLOSE_GRIPPER = _goal("close_gripper", 1.0)
