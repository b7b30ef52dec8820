"""Grasping a block: room for the fingers, alignment, closing.

The fingers close along y and leave a gap of 8 cm when open.
"""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import motion
from lfgp_dmc.tasks.experts.motion import CLOSE, OPEN, Command
from lfgp_dmc.tasks.experts.view import (
  BlockView,
  View,
  across,
  is_between_fingers,
)

GRIP_HEIGHT = 0.009  # m, TCP above the centre of a gripped block
HOVER = 0.050  # m, TCP above the centre of the highest block on the way

_FINGER_INSIDE = 0.040  # m, inner face of an open finger, from the TCP
_FINGER_OUTSIDE = 0.065  # m, outer face of an open finger's thick part
_FINGER_HALF = 0.0115  # m, half width of a finger along x, with a margin
_MOST_X = 0.009  # m, largest offset of a gripped block from the pads' middle
_MOST_Y = 0.010  # m, likewise between the fingers
_SWEPT = 0.10  # m from the middle along y, where a sweep outwards ends
_SWEPT_BACK = 0.06  # m likewise, where a sweep inwards ends
_AT_FINGER = 0.012  # m, TCP to a block at one finger
_ASKEW = math.radians(1.4)
_OPENING = 0.02  # change of the opening in a step while fingers open


def _room(view: View, target: BlockView) -> tuple[float, float] | None:
  """Offset x, y, m, from the target's centre at which the fingers fit.

  None: the other block leaves no room.
  """
  other = view.other(target)
  if abs(other.z - target.z) > 0.030:
    return (0.0, 0.0)
  dx, dy = other.x - target.x, other.y - target.y
  side_x, side_y = math.copysign(1.0, dx), math.copysign(1.0, dy)
  over_x = _FINGER_HALF + other.half - abs(dx)
  over_y = _FINGER_OUTSIDE + other.half - abs(dy)
  if over_x <= 0 or over_y <= 0:
    return (0.0, 0.0)
  fits_x = over_x <= _MOST_X
  fits_y = over_y <= min(_MOST_Y, _FINGER_INSIDE - target.half - 0.003)
  if fits_x and not (fits_y and over_y <= over_x):
    return (-side_x * over_x, 0.0)
  return (0.0, -side_y * over_y) if fits_y else None


def hover_height(view: View) -> float:
  """Height at which the TCP may cross the blocks, m."""
  return max(view.blue.z, view.green.z) + HOVER


def reach(
  view: View, target: BlockView, height: float = GRIP_HEIGHT
) -> Command:
  """Brings the open fingers around a block, pushing it free if need be."""
  offset = _room(view, target)
  if is_between_fingers(view, target) and view.opening > 0.7:
    offset = offset or (0.0, 0.0)
  elif offset is None:
    return _push_free(view, target)
  goal = (target.x + offset[0], target.y + offset[1], _tcp_z(target, height))
  if is_between_fingers(view, target):
    return Command(motion.servo(view, goal), OPEN, noise=0.6)
  # Closed fingers wait above until they are open.
  wait = 0.05 * motion.clip((0.9 - view.opening) / 0.2, 0.0, 1.0)
  goal = (goal[0], goal[1], goal[2] + wait)
  return Command(motion.from_above(view, goal, hover_height(view)), OPEN)


def grasp(view: View, target: BlockView, square: bool = False) -> Command:
  """Reaches a block and closes the fingers on it.

  `square` turns it parallel to the fingers first: closing alone aligns a block
  to 10 degrees, and not at all beyond 35.
  """
  square = square and target.tilt < 0.1
  is_letting_go = view.opening_rate > _OPENING
  if is_between_fingers(view, target) and not is_letting_go:
    side = _sweeping_side(view, target) if square else 0.0
    if side and view.opening > 0.92:
      return _sweep(view, target, side)
    if _is_centred(view, target):
      goal = (target.x, target.y, _tcp_z(target))
      return Command(motion.servo(view, goal, gain=0.2), CLOSE, noise=0.5)
  return reach(view, target)


def _tcp_z(target: BlockView, height: float = GRIP_HEIGHT) -> float:
  """A height above the block's centre, within the set-point box, m."""
  return max(target.z + height, ws.SET_POINT_LOW[2])


def _is_centred(view: View, target: BlockView) -> bool:
  """In the middle of the gap; less strictly once the fingers are closing."""
  if view.opening < 0.92:
    return True
  dx, dy, dz = across(view, target)
  x, y = _room(view, target) or (0.0, 0.0)
  return abs(dx - x) < 0.006 and abs(dy - y) < 0.006 and dz < 0.015


def _sweep(view: View, target: BlockView, side: float) -> Command:
  """Pushes a block along y with one open finger, whose face squares it."""
  goal = (target.x, view.set_point[1] + 0.02 * side, _tcp_z(target))
  return Command(motion.servo(view, goal, speed=0.75), OPEN, noise=0.6)


def _sweeping_side(view: View, target: BlockView) -> float:
  """Direction along y of a sweep; 0 where sweeps end.

  The block's place decides, which is easier to observe and to imitate than a
  degree of yaw: outwards until it is 10 cm from the middle. Only a block that
  is askew even there is swept back in, to be swept out again.
  """
  off_middle = target.y - ws.CENTRE_XY[1]
  outwards = math.copysign(1.0, off_middle)
  is_at_inner_finger = -outwards * (view.tcp[1] - target.y) > _AT_FINGER
  if abs(off_middle) > _SWEPT:
    return -outwards if abs(target.yaw) > _ASKEW else 0.0
  if is_at_inner_finger and abs(off_middle) > _SWEPT_BACK:
    return -outwards
  return outwards


def _push_free(view: View, target: BlockView) -> Command:
  """Pushes a block along x with closed fingers, away from its neighbour."""
  other = view.other(target)
  side = 1.0 if target.x > other.x else -1.0
  if abs(other.x) > 0.07:  # towards the middle, not up the wall
    side = -math.copysign(1.0, other.x)
  dx, dy, dz = across(view, target)
  low = _tcp_z(target, 0.004)
  behind = -side * (target.half + 0.022)
  if dz < 0.022 and abs(dy) < 0.012 and side * dx < -0.018:
    goal = (view.set_point[0] + side * 0.03, target.y, low)
    return Command(motion.servo(view, goal, speed=0.7), CLOSE, noise=0.6)
  wait = 0.05 * motion.clip((view.opening - 0.1) / 0.2, 0.0, 1.0)
  goal = (target.x + behind, target.y, low + wait)
  return Command(motion.from_above(view, goal, hover_height(view)), CLOSE)
