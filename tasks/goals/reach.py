"""Reach: the TCP is at the blue block."""

from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot


def is_reached(state: Snapshot) -> bool:
  """|p_e - p_b| < 1.5 cm."""
  return state.distance < 0.015


def dense_terms(state: Snapshot) -> Terms:
  """1 - tanh(10 d), and the box's limits."""
  return {
    "reach": terms.closeness(0.0, state.tcp, state.blue),
    "limits": terms.limits(state),
  }


REACH = Goal("reach", is_reached, dense_terms, is_penalised_off_tray=True)
