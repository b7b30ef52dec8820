"""Reads the simulator once a control step: a snapshot and the 59 floats.

Entities hand out MJCF elements; this file resolves them to addresses once,
after compilation, so that a step costs a few array reads.
"""

import math

import numpy as np
from dm_control import mjcf

from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.entities import Block, Panda, Tray
from lfgp_dmc.tasks.entities.panda_links import FINGER_TRAVEL
from lfgp_dmc.tasks.rotations import reduce_rotation
from lfgp_dmc.tasks.snapshot import Snapshot

_WRENCH_SCALE = np.array([100.0] * 3 + [10.0] * 3)  # N, N m

# Bits of the contact table: the owner of a geom.
_BLUE, _GREEN, _TRAY, _ROBOT = 1, 2, 4, 8


class FeatureReader:
  """Turns the state of a compiled world into a snapshot and 59 floats."""

  def __init__(self, panda: Panda, blue: Block, green: Block, tray: Tray):
    self._panda, self._blue, self._green = panda, blue, green
    self._tray = tray

  def after_compile(self, physics: mjcf.Physics) -> None:
    """Resolves elements to addresses; once per compilation."""
    model = physics.model
    addresses = np.asarray(model.sensor_adr)

    def address(sensor) -> int:
      return int(addresses[physics.bind(sensor).element_id])

    sensors = self._panda.sensors
    self._tcp = address(sensors["tcp_position"])
    self._tcp_velocity = address(sensors["tcp_velocity"])
    self._finger = address(sensors["left_finger"])
    force = address(sensors["force"])  # and the torque behind it
    self._wrench = slice(force, force + 6)
    self._blocks = [
      {name: address(sensor) for name, sensor in block.sensors.items()}
      for block in (self._blue, self._green)
    ]
    self._rotations = np.array(
      [range(part["rotation"], part["rotation"] + 4) for part in self._blocks]
    )
    self._map_linear_part(model.nsensordata)
    free_joint = mjcf.get_frame_freejoint(self._blue.mjcf_model)
    dof = int(np.asarray(model.jnt_dofadr)[physics.bind(free_joint).element_id])
    self._blue_dofs = slice(dof, dof + 3)
    self._find_owners(physics)
    self._weigh_hand(physics)
    self.reset_history(np.zeros(2))

  def _find_owners(self, physics) -> None:
    self._owner = np.zeros(physics.model.ngeom, np.int64)
    for owner, geoms in (
      (_BLUE, [self._blue.geom]),
      (_GREEN, [self._green.geom]),
      (_TRAY, self._tray.geoms),
      (_ROBOT, self._panda.collision_geoms),
    ):
      self._owner[physics.bind(geoms).element_id] = owner

  def _weigh_hand(self, physics) -> None:
    """Weight beyond the wrist and its lever, in the hand's frame."""
    bodies = physics.bind(self._panda.hanging_bodies)
    wrist = physics.bind(self._panda.wrist)
    self._wrist_id = int(wrist.element_id)
    self._weight = float(np.sum(bodies.mass)) * -physics.model.opt.gravity[2]
    centre = np.average(np.array(bodies.xipos), axis=0, weights=bodies.mass)
    frame = np.array(wrist.xmat).reshape(3, 3)
    self._lever = (frame.T @ (centre - np.array(wrist.xpos))).tolist()

  def reset_history(self, fingers: np.ndarray) -> None:
    """Fills the fingers' history with a reading, float [2], 0..1."""
    self._finger_history = np.concatenate([fingers, fingers])

  def snapshot(self, physics: mjcf.Physics, action, moved: bool) -> Snapshot:
    """The world now; `moved` is False at reset, where accelerations are 0."""
    data = physics.data.ptr
    values = data.sensordata.tolist()
    blue, green = self._blocks
    touching = self._touching(data)
    acceleration = data.qacc[self._blue_dofs].tolist() if moved else (0.0,)

    def three(start: int):
      return (values[start], values[start + 1], values[start + 2])

    return Snapshot(
      tcp=three(self._tcp),
      tcp_speed=math.hypot(*three(self._tcp_velocity)),
      fingers=(
        values[self._finger] / FINGER_TRAVEL,
        values[self._finger + 1] / FINGER_TRAVEL,
      ),
      blue=three(blue["position"]),
      green=three(green["position"]),
      blue_speed=math.hypot(*three(blue["linear_velocity"])),
      blue_acceleration=math.hypot(*acceleration),
      blue_on_green=(_BLUE | _GREEN) in touching,
      blue_on_tray=(_BLUE | _TRAY) in touching,
      blue_on_robot=(_BLUE | _ROBOT) in touching,
      action=tuple(action.tolist()),
    )

  def _touching(self, data) -> set[int]:
    pairs = self._owner[data.contact.geom]
    return set((pairs[:, 0] | pairs[:, 1]).tolist())

  def robot_touches(self, physics: mjcf.Physics) -> tuple[bool, bool]:
    """Whether blue, and whether green, is in contact with the robot."""
    touching = self._touching(physics.data.ptr)
    return (_ROBOT | _BLUE) in touching, (_ROBOT | _GREEN) in touching

  def features(self, physics: mjcf.Physics) -> np.ndarray:
    """The observation, float32 [59]; call once a control step."""
    sensed = physics.data.ptr.sensordata
    out = self._matrix @ sensed
    out += self._offset
    out[8:12] = self._finger_history
    self._finger_history = np.concatenate([out[10:12], out[6:8]])
    blue, green = reduce_rotation(sensed[self._rotations])
    out[15:19], out[22:26] = blue, green
    out[53:59] = self._force_torque(physics, sensed)
    return out.astype(np.float32)

  def _map_linear_part(self, size: int) -> None:
    """`matrix @ sensordata + offset`: all but rotations, history and forces."""
    blue, green = self._blocks
    matrix = np.zeros((OBSERVATION_SIZE, size))
    offset = np.zeros(OBSERVATION_SIZE)

    def add(row: int, start: int, count: int = 3, factor: float = 1.0):
      for index in range(count):
        matrix[row + index, start + index] += factor

    add(0, self._tcp)
    add(3, self._tcp_velocity)
    add(6, self._finger, 2, 1.0 / FINGER_TRAVEL)
    for block, pose, velocity, from_tcp, to_slot, slot in (
      (blue, 12, 26, 38, 47, ws.BLUE_SLOT),
      (green, 19, 32, 41, 50, ws.GREEN_SLOT),
    ):
      add(pose, block["position"])
      add(velocity, block["linear_velocity"])
      add(velocity + 3, block["angular_velocity"])
      add(from_tcp, block["position"])
      add(from_tcp, self._tcp, factor=-1.0)
      add(to_slot, block["position"], factor=-1.0)
      offset[to_slot : to_slot + 3] = slot
    add(44, green["position"])
    add(44, blue["position"], factor=-1.0)
    self._matrix, self._offset = matrix, offset

  def _force_torque(self, physics, sensed) -> np.ndarray:
    """Tanh of the wrist's load apart from the hand, float [6]."""
    frame = physics.data.ptr.site_xmat[self._wrist_id, 6:9].tolist()
    # The sensor reads what holds the hand up: minus the weight, in its frame.
    a, b, c = (self._weight * axis for axis in frame)
    x, y, z = self._lever
    held = (a, b, c, y * c - z * b, z * a - x * c, x * b - y * a)
    return np.tanh((sensed[self._wrench] - held) / _WRENCH_SCALE)
