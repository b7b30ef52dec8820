"""Start states: where the arm and the blocks are after a reset.

Everything random is drawn from the random state that is handed in.
"""

import math
from dataclasses import dataclass

import numpy as np
from dm_control import mjcf
from dm_control.utils import inverse_kinematics

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.control import DOWN
from lfgp_dmc.tasks.entities import Panda
from lfgp_dmc.tasks.entities.panda_links import FINGER_TRAVEL, HOME
from lfgp_dmc.tasks.goals.starts import BlockStart
from lfgp_dmc.tasks.world import World

_GAP = 0.0005  # m, least gap between two sampled blocks
_IK_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Request:
  """A requested start state; None is sampled."""

  tcp: np.ndarray | None = None  # [3], m
  blue: np.ndarray | None = None  # [7], m and quaternion w x y z
  green: np.ndarray | None = None
  fingers: float | None = None  # opening, 0..1; None is open


def place_all(
  physics: mjcf.Physics,
  random_state: np.random.RandomState,
  world: World,
  spawn: str,
  start: BlockStart,
  request: Request,
) -> None:
  """Puts arm, set-point and blocks where an episode starts.

  `spawn` and `start` say how to sample what `request` leaves open.

  Raises:
    ValueError: the arm cannot reach the requested TCP.
  """
  tcp = request.tcp
  if tcp is None:
    tcp = _sample_tcp(random_state, spawn)
  fingers = 1.0 if request.fingers is None else request.fingers
  poses = _sample_blocks(random_state, spawn, start, request)
  for block, pose in zip((world.blue, world.green), poses, strict=True):
    block.set_pose(physics, position=pose[:3], quaternion=pose[3:])
    block.set_velocity(physics, np.zeros(3), np.zeros(3))
  _place_arm(physics, world.panda, tcp, fingers)
  physics.forward()
  world.control.reset(physics, fingers)


def _place_arm(physics, panda: Panda, tcp, fingers: float) -> None:
  """Sets the arm so that the hand points down with its TCP at `tcp`."""
  physics.bind(panda.joints).qpos = HOME
  physics.bind(panda.finger_joints).qpos = fingers * FINGER_TRAVEL
  result = inverse_kinematics.qpos_from_site_pose(
    physics,
    panda.tcp.full_identifier,
    target_pos=tcp,
    target_quat=DOWN,
    joint_names=[joint.full_identifier for joint in panda.joints],
    tol=_IK_TOLERANCE,
    max_steps=200,
    inplace=True,
  )
  reached = physics.bind(panda.tcp).xpos
  if not result.success and math.dist(reached, tcp) > 1e-3:
    raise ValueError(f"the arm cannot reach tcp={tcp.tolist()} pointing down")


def _sample_tcp(random_state, spawn: str) -> np.ndarray:
  """A TCP 5 to 14.5 cm above the floor, float [3], m."""
  half = ws.FLOOR_HALF if spawn == "full_tray" else ws.SPAWN_HALF
  (x, y), heights = ws.CENTRE_XY, ws.TCP_START_Z
  ranges = ((x - half, x + half), (y - half, y + half), heights)
  return np.array([random_state.uniform(*bounds) for bounds in ranges])


def _sample_blocks(
  random_state, spawn: str, start: BlockStart, request: Request
) -> tuple[np.ndarray, np.ndarray]:
  """Poses of blue and green, float [7] each, never overlapping.

  Blocks start upright, at any yaw, with centres in the central 15 x 15 cm
  ("full_tray": anywhere they fit on the flat floor).
  """
  while True:
    blue, green = request.blue, request.green
    if blue is None:
      blue = _sample_pose(random_state, spawn)
    if green is None:
      green = start.place_green(blue, _sample_pose(random_state, spawn))
    is_given = request.blue is not None and request.green is not None
    if is_given or not _overlap(blue, green):
      return blue, green


def _sample_pose(random_state, spawn: str) -> np.ndarray:
  """An upright block just above the flat floor."""
  yaw = random_state.uniform(0.0, 2.0 * math.pi)
  if spawn == "full_tray":
    reach = abs(math.cos(yaw)) + abs(math.sin(yaw))
    half = ws.FLOOR_HALF - ws.BLOCK_HALF * reach
  else:
    half = ws.SPAWN_HALF
  xy = ws.CENTRE_XY + random_state.uniform(-half, half, size=2)
  turn = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
  return np.array([*xy, ws.FLAT_Z + ws.START_CLEARANCE, *turn])


def _overlap(blue: np.ndarray, green: np.ndarray) -> bool:
  """Whether two upright blocks' footprints overlap at the same height."""
  if abs(blue[2] - green[2]) >= 2 * ws.BLOCK_HALF:
    return False
  gap = green[:2] - blue[:2]
  corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]) * ws.BLOCK_HALF
  first, second = _rotation(blue), _rotation(green)
  shapes = corners @ first.T, corners @ second.T + gap
  # Separating axes: the sides of both squares.
  for axis in (*first.T, *second.T):
    one, other = (shape @ axis for shape in shapes)
    if one.max() + _GAP < other.min() or other.max() + _GAP < one.min():
      return False
  return True


def _rotation(pose: np.ndarray) -> np.ndarray:
  """The yaw of a pose as a 2 x 2 rotation."""
  w, x, y, z = pose[3:7]
  yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
  cos, sin = math.cos(yaw), math.sin(yaw)
  return np.array([[cos, -sin], [sin, cos]])
