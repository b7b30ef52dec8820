"""Experts of the auxiliary tasks, each a function of one observation."""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import grasp, motion, place
from lfgp_dmc.tasks.experts.motion import CLOSE, OPEN, Command
from lfgp_dmc.tasks.experts.view import (
  View,
  across,
  is_between_fingers,
  is_held,
)

_NEAR = 0.07  # m, TCP to block
_LIFT_Z = 0.272  # m, of the TCP
_ORBIT = (0.0, 0.5, 0.235)  # m, centre of Move-Object's circle
_ORBIT_RADIUS = 0.06  # m
_ORBIT_SPEED = 0.62
_RESTLESS = 5.0  # noise factor of the gripper tasks, which need no precision


def open_gripper(view: View) -> Command:
  """Opens the fingers, hovering over the nearest block."""
  return Command(_hover(view), OPEN, _RESTLESS)


def close_gripper(view: View) -> Command:
  """Closes the fingers, on the block between them if there is one."""
  for block in (view.blue, view.green):
    if is_between_fingers(view, block):
      goal = (block.x, block.y, block.z + grasp.GRIP_HEIGHT)
      return Command(motion.servo(view, goal, speed=0.3), CLOSE)
  return Command(_hover(view), CLOSE, _RESTLESS)


def _hover(view: View) -> motion.Vector:
  """Stays where it is, within reach of the nearest block."""
  nearest = min(
    (view.blue, view.green), key=lambda block: math.hypot(*across(view, block))
  )
  dx, dy, dz = across(view, nearest)
  away = math.hypot(dx, dy, dz)
  if away < _NEAR:
    return motion.stay(view)
  share = _NEAR / away
  goal = (
    nearest.x + share * dx,
    nearest.y + share * dy,
    nearest.z + max(share * dz, 0.045),
  )
  return motion.servo(view, goal, speed=0.6)


def reach(view: View) -> Command:
  """Puts the open fingers around blue."""
  if freeing := place.free_blue(view):
    return freeing
  if is_held(view, view.blue):
    return Command(motion.stay(view), CLOSE)
  return grasp.reach(view, view.blue, height=0.003)


def _take_blue(view: View) -> Command | None:
  """Frees and grasps blue; None: it is in hand."""
  freeing = place.free_blue(view)
  if freeing or is_held(view, view.blue):
    return freeing
  return grasp.grasp(view, view.blue)


def lift(view: View) -> Command:
  """Grasps blue and takes it up."""
  if taking := _take_blue(view):
    return taking
  goal = (view.tcp[0], view.tcp[1], _LIFT_Z)
  return Command(motion.servo(view, goal), CLOSE)


def move_object(view: View) -> Command:
  """Grasps blue and carries it round a circle over the tray."""
  if taking := _take_blue(view):
    return taking
  x, y = view.tcp[0] - _ORBIT[0], view.tcp[1] - _ORBIT[1]
  radius = max(math.hypot(x, y), 1e-6)
  # Along the circle, corrected towards it; up while it is low.
  inwards = motion.clip((_ORBIT_RADIUS - radius) / 0.04, -1.0, 1.0)
  upwards = motion.clip((_ORBIT[2] - view.set_point[2]) / 0.03, -1.0, 1.0)
  clear = motion.clip((view.tcp[2] - ws.FLAT_Z - 0.02) / 0.03, 0.0, 1.0)
  along = (
    clear * (-y + inwards * x) / radius,
    clear * (x + inwards * y) / radius,
    upwards,
  )
  scale = _ORBIT_SPEED / max(math.hypot(*along), 1.0)
  dx, dy, dz = along
  return Command((scale * dx, scale * dy, scale * dz), CLOSE)
