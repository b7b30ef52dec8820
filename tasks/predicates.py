"""What can be true of a snapshot; the goals are composed of these."""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.snapshot import Snapshot

NEAR = 0.10  # m, TCP to block: "remaining reasonably close"
SLOW = 0.08  # m/s, TCP
FACE_MARGIN = 0.005  # m to a face of the set-point box


def distance(state: Snapshot) -> float:
  """TCP to blue, |p_e - p_b|, m."""
  return math.dist(state.tcp, state.blue)


def is_near_a_block(state: Snapshot) -> bool:
  """The TCP is within 10 cm of one of the blocks."""
  nearest = min(distance(state), math.dist(state.tcp, state.green))
  return nearest <= NEAR


def is_slow(state: Snapshot) -> bool:
  """The TCP moves at less than 8 cm/s."""
  return state.tcp_speed < SLOW


def height(state: Snapshot) -> float:
  """Blue's height above where it lies flat, m."""
  return state.blue[2] - ws.FLAT_Z


def is_released_on_tray(state: Snapshot) -> bool:
  """Blue touches the tray and not the robot."""
  return state.blue_on_tray and not state.blue_on_robot


def are_fingers_between(state: Snapshot, low: float, high: float) -> bool:
  """Both fingers' openings are in (low, high): G(low, high) of the facts."""
  left, right = state.fingers
  return low < left < high and low < right < high
