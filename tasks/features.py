"""Reads the simulator once a control step: a snapshot and the 59 floats.

Entities hand out MJCF elements; this file resolves them to addresses once,
after compilation, so that a step costs a few array reads.
"""

import math

import numpy as np
from dm_control import mjcf

from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.rotations import reduce_rotation
from tasks import workspace as ws
from tasks.entities import Block, Panda, Tray
from tasks.entities.panda_links import FINGER_TRAVEL
from tasks.snapshot import Snapshot

_FORCE_SCALE = 100.0  # N
_TORQUE_SCALE = 10.0  # N m

# Bits of the contact table: who a geom belongs to.
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
    self._force = address(sensors["force"])
    block_parts = (
      "position",
      "rotation",
      "linear_velocity",
      "angular_velocity",
    )
    self._blocks = [
      {name: address(block.sensors[name]) for name in block_parts}
      for block in (self._blue, self._green)
    ]
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
    self._weight = float(np.sum(bodies.mass)) * -physics.model.opt.gravity[2]
    self._wrist_id = int(physics.bind(self._panda.wrist).element_id)
    wrist = physics.bind(self._panda.wrist)
    centre = np.average(np.array(bodies.xipos), axis=0, weights=bodies.mass)
    frame = np.array(wrist.xmat).reshape(3, 3)
    self._lever = frame.T @ (centre - np.array(wrist.xpos))

  def reset_history(self, fingers: np.ndarray) -> None:
    """Fills the fingers' history with a reading, float [2], 0..1."""
    self._finger_history = [fingers, fingers]

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

  def robot_touches_block(self, physics: mjcf.Physics) -> bool:
    """Is any block in contact with the robot."""
    touching = self._touching(physics.data.ptr)
    return bool(touching & {_ROBOT | _BLUE, _ROBOT | _GREEN})

  def features(self, physics: mjcf.Physics) -> np.ndarray:
    """The 59 floats of the contract, float32 [59]; call once a control step."""
    sensed = physics.data.ptr.sensordata
    out = np.empty(OBSERVATION_SIZE)
    tcp, finger = self._tcp, self._finger
    out[0:3] = sensed[tcp : tcp + 3]
    out[3:6] = sensed[self._tcp_velocity : self._tcp_velocity + 3]
    fingers = sensed[finger : finger + 2] / FINGER_TRAVEL
    out[6:8] = fingers
    out[8:10], out[10:12] = self._finger_history
    self._finger_history = [self._finger_history[1], fingers]
    for block, pose, velocity in (
      (self._blocks[0], 12, 26),
      (self._blocks[1], 19, 32),
    ):
      start = block["position"]
      out[pose : pose + 3] = sensed[start : start + 3]
      start = block["rotation"]
      out[pose + 3 : pose + 7] = reduce_rotation(sensed[start : start + 4])
      start = block["linear_velocity"]
      out[velocity : velocity + 3] = sensed[start : start + 3]
      start = block["angular_velocity"]
      out[velocity + 3 : velocity + 6] = sensed[start : start + 3]
    out[38:41] = out[12:15] - out[0:3]
    out[41:44] = out[19:22] - out[0:3]
    out[44:47] = out[19:22] - out[12:15]
    out[47:50] = _BLUE_SLOT - out[12:15]
    out[50:53] = _GREEN_SLOT - out[19:22]
    out[53:59] = self._force_torque(physics, sensed)
    return out.astype(np.float32)

  def _force_torque(self, physics, sensed) -> np.ndarray:
    """Tanh of what the wrist carries beyond its own hand, float [6]."""
    frame = physics.data.ptr.site_xmat[self._wrist_id]
    # The sensor reads what holds the hand up: minus the weight, in its frame.
    held = self._weight * frame[6:9]
    x, y, z = self._lever
    torque = (
      y * held[2] - z * held[1],
      z * held[0] - x * held[2],
      x * held[1] - y * held[0],
    )
    start = self._force
    out = np.array(sensed[start : start + 6])
    out[:3] -= held
    out[3:] -= torque
    out[:3] /= _FORCE_SCALE
    out[3:] /= _TORQUE_SCALE
    return np.tanh(out)


_BLUE_SLOT = np.array(ws.BLUE_SLOT)
_GREEN_SLOT = np.array(ws.GREEN_SLOT)
