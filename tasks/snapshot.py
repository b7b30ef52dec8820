"""The world at one instant, as plain numbers for predicates and rewards."""

from dataclasses import dataclass

Vector = tuple[float, float, float]


@dataclass(slots=True)
class Snapshot:
  """Positions in m, velocities in m/s, in the robot's base frame.

  Attributes:
    tcp, tcp_speed: tool centre point (p_e of the paper) and its speed.
    fingers: finger openings g_1, g_2; 0 closed, 1 open.
    blue, green: block centres p_b, p_g.
    blue_speed: |v_b|.
    blue_acceleration: |a_b|, m/s^2: velocity change over the last physics
      step; 0 at reset.
    blue_on_green, blue_on_tray, blue_on_robot: blue's contacts.
    action: the last action, clipped; a_g is its fourth value. Zeros at reset.
  """

  tcp: Vector
  tcp_speed: float
  fingers: tuple[float, float]
  blue: Vector
  green: Vector
  blue_speed: float
  blue_acceleration: float
  blue_on_green: bool
  blue_on_tray: bool
  blue_on_robot: bool
  action: tuple[float, float, float, float]
