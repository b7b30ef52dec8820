"""Handling a held block: carrying, setting down, leaving."""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import grasp, motion
from lfgp_dmc.tasks.experts.motion import CLOSE, OPEN, Command
from lfgp_dmc.tasks.experts.view import (
  BlockView,
  Vector,
  View,
  across,
  is_held,
  is_on,
)

_CARRY = 0.054  # m, a carried block's centre above the other's
_ASIDE = 0.09  # m from blue along x, where green is set aside
CLEAR_OF_SLOTS = 0.05  # m from the middle along y
CLEAR_OF_ZONES = 0.10  # m likewise, with the fingers' room beside a zone
_LEAVE = 0.065  # m, TCP above a released block


def carry(
  view: View, block: BlockView, spot: Vector, **funnel: float
) -> Vector:
  """Moves a held block's centre to `spot`; `funnel`: see `from_above`."""
  dx, dy, dz = across(view, block)
  goal = (spot[0] + dx, spot[1] + dy, spot[2] + dz)
  hover = max(view.other(block).z + _CARRY, spot[2] + 0.02) + dz
  return motion.from_above(view, goal, hover, **funnel)


def set_down(
  view: View, block: BlockView, spot: tuple[float, float]
) -> Command:
  """Carries a held block to a spot of the flat floor and lets it go."""
  error = math.hypot(block.x - spot[0], block.y - spot[1])
  grip = OPEN if error < 0.018 and block.z < ws.FLAT_Z + 0.006 else CLOSE
  to = (*spot, ws.FLAT_Z + 0.001)
  return Command(carry(view, block, to, narrow=0.012), grip, noise=0.8)


def leave(view: View, block: BlockView) -> Command:
  """Opens the fingers and rises from a block that is in place."""
  free = motion.clip((view.opening - 0.6) / 0.3, 0.0, 1.0)
  goal = (view.tcp[0], view.tcp[1], block.z + _LEAVE)
  x, y, z = motion.servo(view, goal, speed=0.7)
  return Command((x, y, free * z), OPEN, noise=0.8)


def set_green_aside(view: View, least_y: float) -> Command:
  """Puts the held green block beside blue, at least `least_y` from y = 0.5."""
  blue = view.blue
  dy = blue.y - ws.CENTRE_XY[1]
  spot = (
    blue.x - math.copysign(_ASIDE, blue.x),
    ws.CENTRE_XY[1] + math.copysign(max(abs(dy), least_y), dy),
  )
  return set_down(view, view.green, spot)


def free_blue(view: View, least_y: float = CLEAR_OF_SLOTS) -> Command | None:
  """Takes green away if it is in hand or on blue; None: nothing to do."""
  if is_held(view, view.green) and not is_held(view, view.blue):
    return set_green_aside(view, least_y)
  if is_on(view.green, view.blue):
    return grasp.grasp(view, view.green)
  return None
