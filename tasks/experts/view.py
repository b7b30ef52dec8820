"""A scripted expert's view of the 59 floats, by name."""

import math
from dataclasses import dataclass

import numpy as np

Vector = tuple[float, float, float]

_LAG = 0.095  # s, by which the TCP trails its set-point
_STILL = 0.015  # change of the opening in one step of fingers at rest
# Openings around a 4 cm block: flat faces give 0.5, the diagonal 0.72.
_GRIP = (0.40, 0.80)


@dataclass(slots=True)
class BlockView:
  """A block; lengths in m, angles in rad."""

  x: float  # of its centre
  y: float
  z: float
  yaw: float  # turn about z away from the axes, within +-45 degrees
  tilt: float  # angle between its most upright side and the vertical

  @property
  def half(self) -> float:
    """Half the side of its axis-parallel footprint, m."""
    return 0.02 * (abs(math.cos(self.yaw)) + abs(math.sin(self.yaw)))


@dataclass(slots=True)
class View:
  """One observation; lengths in m."""

  tcp: Vector  # tool centre point
  set_point: Vector  # estimated from the TCP's velocity and its lag
  opening: float  # mean of the fingers, 0 closed to 1 open
  opening_rate: float  # its change over the last step, > 0 when they open
  blue: BlockView
  green: BlockView
  control_hz: int = 20

  def other(self, block: BlockView) -> BlockView:
    """The block that is not `block`."""
    return self.green if block is self.blue else self.blue


def look(observation: np.ndarray, control_hz: int = 20) -> View:
  """Names the floats of a flat observation, float32 [59]."""
  o = observation.tolist()
  opening = (o[6] + o[7]) / 2
  before = (o[10] + o[11]) / 2
  return View(
    tcp=(o[0], o[1], o[2]),
    set_point=(o[0] + _LAG * o[3], o[1] + _LAG * o[4], o[2] + _LAG * o[5]),
    opening=opening,
    opening_rate=opening - before,
    blue=_block(o[12:19]),
    green=_block(o[19:26]),
    control_hz=control_hz,
  )


def _block(pose: list[float]) -> BlockView:
  x, y, z, qw, qx, qy, qz = pose
  yaw = 2 * math.atan2(qz, qw)
  tilt = math.acos(max(-1.0, min(1.0, 1 - 2 * (qx * qx + qy * qy))))
  return BlockView(x, y, z, yaw, tilt)


def across(view: View, block: BlockView) -> Vector:
  """TCP minus block, m."""
  x, y, z = view.tcp
  return (x - block.x, y - block.y, z - block.z)


def is_between_fingers(view: View, block: BlockView) -> bool:
  """Whether the block is in the gap, low enough to be gripped."""
  dx, dy, dz = across(view, block)
  return abs(dx) < 0.018 and abs(dy) < 0.022 and -0.014 < dz < 0.019


def is_held(view: View, block: BlockView) -> bool:
  """Whether the fingers have stopped at the block's width."""
  low, high = _GRIP
  return (
    abs(view.opening_rate) < _STILL
    and low < view.opening < high
    and is_between_fingers(view, block)
  )


def is_on(upper: BlockView, lower: BlockView) -> bool:
  """Whether `upper` rests on `lower`: 4 cm higher, footprints crossing."""
  apart = max(abs(upper.x - lower.x), abs(upper.y - lower.y))
  return apart < 0.030 and 0.028 < upper.z - lower.z < 0.0455
