"""Experts of Bring and Insert, functions of one observation."""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import grasp, motion, place
from lfgp_dmc.tasks.experts.motion import CLOSE, OPEN, Command
from lfgp_dmc.tasks.experts.view import BlockView, View, across, is_held

_BROUGHT = 0.026  # m, horizontal error of a block that may stay
_DODGE = 0.019  # m, largest shift of blue beside the slot in Bring
_IN_MOUTH_Z = ws.INSERTED_Z + 0.0045  # m, an upright block below it drops in
_IN_SLOT_Z = ws.INSERTED_Z + 0.003  # m, any block below it drops in
_SEATED_Z = ws.INSERTED_Z + 0.002  # m
_TILTED = math.radians(3.0)
_JAMMED = math.radians(3.8)
_TOPPLED = math.radians(7.0)
_LEAST_GRIP = 0.002  # m, TCP over the centre of a block gripped for the slot
_ASKEW_ON_FLOOR = math.radians(1.4)
_ASKEW_IN_AIR = math.radians(4.0)
_PARK_X, _PARK_Y = 0.04, 0.07  # m from the middle, on green's other side
_PRESS_HEIGHT = 0.024  # m, of closed fingertips' TCP over a block's centre


def bring(view: View) -> Command:
  """Sets blue down in its zone and lets go."""
  if freeing := place.free_blue(view, place.CLEAR_OF_ZONES):
    return freeing
  blue = view.blue
  spot = _free_spot(view)
  if is_held(view, blue):
    if spot is None:
      return _park_blue(view)
    error = math.hypot(blue.x - spot[0], blue.y - spot[1])
    is_down = blue.z < ws.FLAT_Z + (0.013 if blue.tilt > _TOPPLED else 0.004)
    grip = OPEN if error < 0.006 and is_down else CLOSE
    to = (*spot, ws.FLAT_Z + 0.0005)
    move = place.carry(view, blue, to, narrow=0.003, slope=4.0)
    return Command(move, grip, noise=0.6)
  away = math.hypot(blue.x - ws.BLUE_XY[0], blue.y - ws.BLUE_XY[1])
  if away < _BROUGHT and blue.z < ws.FLAT_Z + 0.006:
    return place.leave(view, blue)
  if spot is None:
    return grasp.grasp(view, view.green)
  return grasp.grasp(view, blue)


def insert(view: View) -> Command:
  """Squares blue, sets it into its slot and lets go."""
  if freeing := place.free_blue(view, place.CLEAR_OF_ZONES):
    return freeing
  blue = view.blue
  away = math.hypot(blue.x - ws.BLUE_XY[0], blue.y - ws.BLUE_XY[1])
  if is_held(view, blue):
    return _insert_held(view, away)
  if away < 0.0025 and blue.z < _SEATED_Z:
    return place.leave(view, blue)
  if away < 0.0025 and blue.z < _IN_MOUTH_Z + 0.004 and blue.tilt < _TOPPLED:
    return _press(view)
  if _is_in_the_way(view.green):
    return grasp.grasp(view, view.green)
  return grasp.grasp(view, blue, square=True)


def _insert_held(view: View, away: float) -> Command:
  blue = view.blue
  is_in_mouth = away < 0.0015 and blue.z < _IN_MOUTH_Z
  if is_in_mouth and (blue.tilt < _TILTED or blue.z < _IN_SLOT_Z):
    return Command(motion.stay(view), OPEN, noise=0.2)
  if away > 0.004:
    if blue.z < ws.FLAT_Z + 0.004 and abs(blue.yaw) > _ASKEW_ON_FLOOR:
      return Command(motion.stay(view), OPEN)
    is_askew = blue.tilt > _TILTED or abs(blue.yaw) > _ASKEW_IN_AIR
    if is_askew or _is_in_the_way(view.green):
      return _park_blue(view)
  # One edge went in and the other did not, or it is gripped too low.
  if blue.tilt > _JAMMED or across(view, blue)[2] < _LEAST_GRIP:
    return _park_blue(view)
  to = (*ws.BLUE_XY, ws.INSERTED_Z + 0.001)
  move = place.carry(view, blue, to, narrow=0.0003, slope=8.0, gain=0.35)
  return Command(move, CLOSE, noise=0.25 if away < 0.006 else 0.6)


def _park_blue(view: View) -> Command:
  """Sets blue down flat, off the slots, with room for the fingers."""
  spot = (
    -math.copysign(_PARK_X, view.green.x),
    ws.CENTRE_XY[1] - math.copysign(_PARK_Y, view.green.y - ws.CENTRE_XY[1]),
  )
  return place.set_down(view, view.blue, spot)


def _press(view: View) -> Command:
  """Presses a block that stuck half-way down, with closed fingers."""
  blue = view.blue
  wait = 0.05 * motion.clip((view.opening - 0.1) / 0.2, 0.0, 1.0)
  goal = (blue.x, blue.y, blue.z + _PRESS_HEIGHT + wait)
  move = motion.from_above(view, goal, grasp.hover_height(view))
  return Command(move, CLOSE, noise=0.5)


def _is_in_the_way(green: BlockView) -> bool:
  """Whether green is on blue's slot, or where the fingers come down there."""
  dx = abs(green.x - ws.BLUE_XY[0]) - green.half
  dy = abs(green.y - ws.BLUE_XY[1]) - green.half
  return (dx < 0.023 and dy < 0.023) or (dx < 0.013 and dy < 0.066)


def _free_spot(view: View) -> tuple[float, float] | None:
  """Where in its zone blue has room beside green; None: nowhere."""
  x, y = ws.BLUE_XY
  green = view.green
  dx, dy = green.x - x, green.y - y
  # Beside it along x, out of the fingers' way: the least shift that does.
  need = view.blue.half + green.half + 0.004
  if abs(dy) > 0.066 + green.half or abs(dx) > need:
    return (x, y)
  shift = need - abs(dx)
  return (x - math.copysign(shift, dx), y) if shift < _DODGE else None
