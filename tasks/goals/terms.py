"""Terms shared by several dense rewards (released code, SAC-X experts)."""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.snapshot import Snapshot

NEAR = 0.10  # m, TCP to block: the paper's "remaining reasonably close"
CLOSED_ON_BLOCK = (0.4, 0.7)  # finger openings around a 4 cm block
_TIGHT = 0.01  # m, TCP to blue
_FACE_MARGIN = 0.005  # m to a face of the set-point box


def closeness(threshold: float, a, b) -> float:
  """1.5 within the threshold, else 1 - tanh(10 |a - b|); lengths in m."""
  gap = math.dist(a, b)
  return 1.5 if gap < threshold else 1.0 - math.tanh(10.0 * gap)


def limits(state: Snapshot) -> float:
  """-0.1 times the push outwards, for each face of the box at the TCP."""
  total = 0.0
  for axis in range(3):
    push = state.action[axis]
    if state.tcp[axis] < ws.SET_POINT_LOW[axis] + _FACE_MARGIN:
      total -= 0.1 * max(0.0, -push)
    if state.tcp[axis] > ws.SET_POINT_HIGH[axis] - _FACE_MARGIN:
      total -= 0.1 * max(0.0, push)
  return total


def near_bonus(state: Snapshot) -> float:
  """0.1 within 10 cm of blue."""
  return 0.1 if state.distance <= NEAR else 0.0


def is_grasp_rising(state: Snapshot) -> bool:
  """Fingers closed on blue, the TCP at its centre, moving up or already up."""
  return (
    state.distance < _TIGHT
    and state.has_fingers_between(*CLOSED_ON_BLOCK)
    and (state.action[2] > 0.1 or state.height > 0.03)
  )


def retreat(state: Snapshot) -> float:
  """0 at the block, 1 from 4 cm on: the TCP leaves a finished block."""
  return min(state.distance / 0.04, 1.0)


def off_tray_penalty(state: Snapshot) -> float:
  """-0.1 unless green lies flat within 1 mm (Unstack-Stack only)."""
  return -0.1 if abs(state.green[2] - ws.FLAT_Z) > 0.001 else 0.0
