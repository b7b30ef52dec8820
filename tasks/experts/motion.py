"""How an expert moves: smooth servoing of the set-point, over obstacles."""

import math
from typing import NamedTuple

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts.view import Vector, View

OPEN, CLOSE = -1, 1

_SPEED = 0.95  # |a| on a long way
_GAIN = 0.4  # share of the remaining way to cover in one step of 50 ms
_GAIN_HZ = 20  # the control rate of such steps
_TOP = 0.285  # m, highest set-point


class Command(NamedTuple):
  """An expert's decision, before noise."""

  move: Vector  # dx, dy, dz of the action
  grip: int  # OPEN or CLOSE
  noise: float = 1.0  # factor on the action noise: below 1 for precision


def clip(value: float, low: float, high: float) -> float:
  """`value` within [low, high]."""
  return low if value < low else high if value > high else value


def servo(
  view: View, goal: Vector, speed: float = _SPEED, gain: float = _GAIN
) -> Vector:
  """The move that takes the set-point straight to a goal, m, softly braking.

  `speed` is the largest |a|, `gain` the share of the remaining way to cover in
  50 ms, near the goal.
  """
  share = 1.0 - (1.0 - gain) ** (_GAIN_HZ / view.control_hz)
  wanted = [
    share / ws.SET_POINT_SPEED * view.control_hz * (to - at)
    for to, at in zip(goal, view.set_point, strict=True)
  ]
  size = math.hypot(*wanted)
  if size < 1e-9:
    return (0.0, 0.0, 0.0)
  scale = speed * math.tanh(size / speed) / size
  x, y, z = wanted
  return (scale * x, scale * y, scale * z)


def from_above(
  view: View,
  goal: Vector,
  hover: float,
  narrow: float = 0.006,
  slope: float = 2.5,
  gain: float = _GAIN,
) -> Vector:
  """Servoes to a goal through a funnel: high when far, down when aligned.

  On the way the TCP is at height `hover`. The funnel ends at a horizontal
  error of `narrow`, m; its slope is height over horizontal error.
  """
  x, y, z = goal
  at_x, at_y, at_z = view.tcp
  error = math.hypot(x - at_x, y - at_y)
  rise = clip(slope * (error - narrow), 0.0, max(hover - z, 0.0))
  height = min(z + rise, _TOP)
  # Below the funnel: first up, then across.
  freedom = clip((at_z - height + 0.035) / 0.02, 0.0, 1.0)
  if error < narrow:
    freedom = 1.0
  to = (
    view.set_point[0] + freedom * (x - view.set_point[0]),
    view.set_point[1] + freedom * (y - view.set_point[1]),
    height,
  )
  return servo(view, to, gain=gain)


def stay(view: View) -> Vector:
  """Brakes: keeps the set-point where the TCP is."""
  return servo(view, view.tcp)
