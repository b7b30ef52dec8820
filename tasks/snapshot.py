"""The world at one instant, as plain numbers for conditions and rewards."""

import math
from dataclasses import dataclass

from lfgp_dmc.tasks import workspace as ws

Vector = tuple[float, float, float]


@dataclass(slots=True)
class Snapshot:
  """Lengths in m, speeds in m/s, in the robot's base frame."""

  tcp: Vector  # tool centre point, p_e of the paper
  tcp_speed: float
  fingers: tuple[float, float]  # openings g_1, g_2; 0 closed, 1 open
  blue: Vector  # centres of the blocks, p_b and p_g
  green: Vector
  blue_speed: float  # |v_b|
  # |a_b|, m/s^2: change of velocity over the last physics step; 0 at reset.
  blue_acceleration: float
  blue_on_green: bool  # contacts of blue
  blue_on_tray: bool
  blue_on_robot: bool
  # The last action, clipped, whose fourth value is a_g. Zeros at reset.
  action: tuple[float, float, float, float]

  @property
  def distance(self) -> float:
    """|p_e - p_b|: TCP to blue, m."""
    return math.dist(self.tcp, self.blue)

  @property
  def height(self) -> float:
    """Of blue above where it lies flat, m."""
    return self.blue[2] - ws.FLAT_Z

  def has_fingers_between(self, low: float, high: float) -> bool:
    """Whether both fingers' openings are in (low, high)."""
    left, right = self.fingers
    return low < left < high and low < right < high
