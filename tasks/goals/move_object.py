"""Move-Object: the blue block moves, smoothly, for a whole second."""

from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot


def is_moving(state: Snapshot) -> bool:
  """|v_b| > 5 cm/s and |a_b| < 5 m/s^2."""
  return state.blue_speed > 0.05 and state.blue_acceleration < 5.0


def dense_terms(state: Snapshot) -> Terms:
  """Speed minus jerks at the block; bonuses near it and for carrying it."""
  at_block = 1.0 if state.distance < 0.04 else 0.0  # m
  is_carried = (
    state.has_fingers_between(*terms.CLOSED_ON_BLOCK) and state.height > 0.005
  )
  return {
    "speed": 5.0 * state.blue_speed * at_block,
    "acceleration": -0.1 * min(state.blue_acceleration, 1.5) * at_block,
    "near": terms.near_bonus(state),
    "carry": 0.1 if is_carried else 0.0,
    "limits": terms.limits(state),
  }


MOVE_OBJECT = Goal(
  "move_object",
  is_moving,
  dense_terms,
  is_penalised_off_tray=True,
  hold_checks=20,
)
