"""Lift: the blue block is off the tray."""

from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot

_TOP = 0.08  # m, where the dense reward is full


def is_lifted(state: Snapshot) -> bool:
  """Blue's centre is more than 6 cm above where it lies flat."""
  return state.height > 0.06


def dense_terms(state: Snapshot) -> Terms:
  """Height while gripped, a bonus near the block and one for the grasp."""
  return {
    "height": _height_term(state),
    "near": terms.near_bonus(state),
    "grasp": 0.3 if terms.is_grasp_rising(state) else 0.0,
    "limits": terms.limits(state),
  }


def _height_term(state: Snapshot) -> float:
  high = state.height
  if high < 0.005 or not state.has_fingers_between(0.4, 0.75):
    return 0.0
  return 1.5 if high > _TOP else high / _TOP


LIFT = Goal("lift", is_lifted, dense_terms, is_penalised_off_tray=True)
