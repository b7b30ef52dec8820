"""Start states: where the arm and the blocks are after a reset.

Each initialiser samples from the random state it is handed, and nothing else.
"""

import math
from dataclasses import dataclass

import numpy as np
from dm_control import mjcf
from dm_control.utils import inverse_kinematics

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.entities import Panda
from lfgp_dmc.tasks.entities.panda_links import FINGER_TRAVEL, HOME

SPAWNS = ("published", "full_tray")

_DOWN = (0.0, 1.0, 0.0, 0.0)  # the hand points down
_CLEARANCE = 0.0005  # m, above the surface a block is set on
_GAP = 0.0005  # m, least gap between two sampled blocks
_IK_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Start:
  """What a reset is asked for; None is sampled.

  Attributes:
    tcp: [3], m.
    blue, green: [7], m and quaternion w x y z.
    fingers: opening, 0..1.
  """

  tcp: np.ndarray | None = None
  blue: np.ndarray | None = None
  green: np.ndarray | None = None
  fingers: float | None = None


def place_arm(physics: mjcf.Physics, panda: Panda, tcp, fingers: float) -> None:
  """Sets the arm so that the hand points down with its TCP at `tcp`.

  Raises:
    ValueError: the arm cannot reach there.
  """
  physics.bind(panda.joints).qpos = HOME
  physics.bind(panda.finger_joints).qpos = fingers * FINGER_TRAVEL
  result = inverse_kinematics.qpos_from_site_pose(
    physics,
    panda.tcp.full_identifier,
    target_pos=tcp,
    target_quat=_DOWN,
    joint_names=[joint.full_identifier for joint in panda.joints],
    tol=_IK_TOLERANCE,
    max_steps=200,
    inplace=True,
  )
  reached = physics.bind(panda.tcp).xpos
  if not result.success and math.dist(reached, tcp) > 1e-3:
    raise ValueError(f"the arm cannot reach tcp={tuple(tcp)} pointing down")


def sample_tcp(random_state: np.random.RandomState, spawn: str) -> np.ndarray:
  """A start of the TCP, 5 to 14.5 cm above the floor, float [3], m."""
  half = ws.FLOOR_HALF if spawn == "full_tray" else ws.SPAWN_HALF
  low_z, high_z = ws.TCP_START_Z
  return np.array(
    [
      random_state.uniform(ws.CENTRE_XY[0] - half, ws.CENTRE_XY[0] + half),
      random_state.uniform(ws.CENTRE_XY[1] - half, ws.CENTRE_XY[1] + half),
      random_state.uniform(low_z, high_z),
    ]
  )


def sample_blocks(
  random_state: np.random.RandomState,
  spawn: str,
  green_on_blue: bool,
  start: Start,
) -> tuple[np.ndarray, np.ndarray]:
  """Poses of blue and green, float [7] each, never overlapping.

  Blocks start upright, at any yaw, with centres in the central 15 x 15 cm
  ("full_tray": anywhere they fit on the flat floor). What `start` gives is
  kept; `green_on_blue` puts a sampled green on top of blue.
  """
  while True:
    blue = start.blue
    if blue is None:
      blue = _sample_pose(random_state, spawn)
    if start.green is not None:
      green = start.green
    else:
      green = _sample_pose(random_state, spawn)
      if green_on_blue:
        green[:2] = blue[:2]
        green[2] = blue[2] + 2 * ws.BLOCK_HALF + _CLEARANCE
    given = start.blue is not None and start.green is not None
    if given or not _overlap(blue, green):
      return blue, green


def _sample_pose(random_state, spawn: str) -> np.ndarray:
  """An upright block just above the flat floor."""
  yaw = random_state.uniform(0.0, 2.0 * math.pi)
  if spawn == "full_tray":
    reach = abs(math.cos(yaw)) + abs(math.sin(yaw))
    half = ws.FLOOR_HALF - ws.BLOCK_HALF * reach
  else:
    half = ws.SPAWN_HALF
  x, y = random_state.uniform(-half, half, size=2)
  return np.array(
    [
      ws.CENTRE_XY[0] + x,
      ws.CENTRE_XY[1] + y,
      ws.FLAT_Z + _CLEARANCE,
      math.cos(yaw / 2),
      0.0,
      0.0,
      math.sin(yaw / 2),
    ]
  )


def _overlap(blue: np.ndarray, green: np.ndarray) -> bool:
  """Do two upright blocks' footprints overlap at the same height."""
  if abs(blue[2] - green[2]) >= 2 * ws.BLOCK_HALF:
    return False
  gap = green[:2] - blue[:2]
  corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * ws.BLOCK_HALF
  first, second = _rotation(blue), _rotation(green)
  shapes = corners @ first.T, corners @ second.T + gap
  # Separating axes: the sides of both squares.
  for axis in (*first.T, *second.T):
    spans = [shape @ axis for shape in shapes]
    if (
      spans[0].max() + _GAP < spans[1].min()
      or spans[1].max() + _GAP < spans[0].min()
    ):
      return False
  return True


def _rotation(pose: np.ndarray) -> np.ndarray:
  """The yaw of a pose as a 2 x 2 rotation."""
  w, x, y, z = pose[3:7]
  yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
  return np.array(
    [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
  )
