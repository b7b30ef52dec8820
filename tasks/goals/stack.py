"""Stack and Unstack-Stack: blue rests on green.

The two differ in how the episode starts, and in what comes with that start:
the penalty for a green block that does not lie flat.
"""

import math

from lfgp_dmc.tasks.goals import starts, terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot

_ABOVE_GREEN = 0.041  # m, centre to centre, of a block about to be let go
_PLACED = 0.005  # m


def is_stacked(state: Snapshot) -> bool:
  """Blue touches green, and neither the tray nor the robot."""
  return state.blue_on_green and not (state.blue_on_tray or state.blue_on_robot)


def dense_terms(state: Snapshot) -> Terms:
  """The released code's terms, all zero beyond 10 cm of blue."""
  if state.distance > terms.NEAR:
    return dict.fromkeys(("place", "retreat", "lift", "grasp", "open"), 0.0)
  x, y, z = state.green
  goal = (x, y, z + _ABOVE_GREEN)
  high = state.height
  is_up = high > 0.035
  is_still = state.blue_speed < 0.01  # m/s
  is_held = state.has_fingers_between(*terms.CLOSED_ON_BLOCK)
  is_placed = math.dist(state.blue, goal) < _PLACED
  return {
    "place": terms.closeness(_PLACED, state.blue, goal) if is_up else 0.0,
    "retreat": terms.retreat(state) if is_up and is_still else 0.0,
    # The released code's clip is full at 7 mm already.
    "lift": 0.2 * min(high / 0.035, 1.0) if high > 0.005 and is_held else 0.0,
    "grasp": 0.1 if terms.is_grasp_rising(state) else 0.0,
    "open": 1.0 - state.action[3] if is_placed and high > 0.03 else 0.0,
  }


STACK = Goal("stack", is_stacked, dense_terms, is_penalised_off_tray=True)
UNSTACK_STACK = Goal(
  "unstack_stack",
  is_stacked,
  dense_terms,
  is_penalised_off_tray=True,
  start=starts.GREEN_ON_BLUE,
)
