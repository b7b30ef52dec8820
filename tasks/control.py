"""How actions drive the Panda: an accumulated, clipped set-point.

The set-point is the activation of three integrating velocity servos that act
on the TCP site, so accumulating, clipping to the box and servoing all happen
inside MuJoCo at every physics step. Three position servos on the same site keep
the hand pointing down; gravity is compensated in the model. The gains give the
released environment's response (see tests/tasks/control_test.py).
"""

import math

import numpy as np
from dm_control import mjcf

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.entities.panda import Panda
from lfgp_dmc.tasks.entities.panda_links import FINGER_TRAVEL

ACTION_SIZE = 4

# Per axis, x y z, for equal responses despite unequal masses at the TCP.
# Explicit integration (see arena.py) is stable while the largest eigenvalue of
# timestep x mass^-1 x damping is below 2; it is 1.7.
_POSITION_GAINS = (8000.0, 9800.0, 9000.0)  # N/m
_POSITION_DAMPINGS = (760.0, 885.0, 835.0)  # N s/m
_POSITION_FORCE = 150.0  # N
_ROTATION_GAIN = 650.0  # N m/rad
_ROTATION_DAMPING = 28.0  # N m s/rad
_ROTATION_TORQUE = 50.0  # N m
_FINGER_GAIN = 600.0  # N/m
_FINGER_DAMPING = 60.0  # N s/m
_FINGER_FORCE = 10.0  # N
DOWN = (0.0, 1.0, 0.0, 0.0)  # pi about x: the hand points down
# The y and z axes of such a frame point against the base's.
_SIGNS = (1.0, -1.0, -1.0)


class SetPointControl:
  """Servos of one Panda; turns actions in [-1, 1]^4 into `ctrl`.

  a[:3] moves the set-point along the base axes, a[3] commands the gripper:
  < 0 opens, > 0 closes, exactly 0 keeps the last command.
  """

  def __init__(self, root: mjcf.RootElement, panda: Panda):
    """Adds the servos to the task's root, which holds the robot."""
    self._panda = panda
    down = root.worldbody.add("site", name="down", quat=DOWN, group=4)
    sites = {"site": panda.tcp, "refsite": down}
    self._position: list = []
    self._grip: list = []
    for axis, name in enumerate("xyz"):
      push, turn = np.zeros(6), np.zeros(6)
      push[axis], turn[3 + axis] = _SIGNS[axis], 1.0
      self._position.append(
        root.actuator.add(
          "intvelocity",
          name=f"set_point_{name}",
          gear=push,
          kp=_POSITION_GAINS[axis],
          kv=_POSITION_DAMPINGS[axis],
          actrange=(ws.SET_POINT_LOW[axis], ws.SET_POINT_HIGH[axis]),
          ctrlrange=(-ws.SET_POINT_SPEED, ws.SET_POINT_SPEED),
          forcerange=(-_POSITION_FORCE, _POSITION_FORCE),
          **sites,
        )
      )
      root.actuator.add(
        "position",
        name=f"upright_{name}",
        gear=turn,
        kp=_ROTATION_GAIN,
        kv=_ROTATION_DAMPING,
        forcerange=(-_ROTATION_TORQUE, _ROTATION_TORQUE),
        **sites,
      )
    for side, joint in zip(("left", "right"), panda.finger_joints, strict=True):
      self._grip.append(
        root.actuator.add(
          "position",
          name=f"grip_{side}",
          joint=joint,
          kp=_FINGER_GAIN,
          kv=_FINGER_DAMPING,
          ctrlrange=(0.0, FINGER_TRAVEL),
          forcerange=(-_FINGER_FORCE, _FINGER_FORCE),
        )
      )

  def after_compile(self, physics: mjcf.Physics) -> None:
    """Looks up where the servos' controls and set-points live."""
    position = np.asarray(physics.bind(self._position).element_id)
    self._speed_ids = position
    self._set_point_ids = np.asarray(physics.model.actuator_actadr)[position]
    self._grip_ids = np.asarray(physics.bind(self._grip).element_id)

  def reset(self, physics: mjcf.Physics, opening: float) -> None:
    """Puts the set-point where the TCP is, once the arm has been placed.

    The fingers' opening, 0..1, is held until the first gripper command.
    """
    tcp = physics.bind(self._panda.tcp).xpos
    set_point = np.clip(tcp, ws.SET_POINT_LOW, ws.SET_POINT_HIGH)
    physics.data.act[self._set_point_ids] = set_point
    physics.data.ctrl[:] = 0.0
    physics.data.ctrl[self._grip_ids] = opening * FINGER_TRAVEL

  def apply(self, physics: mjcf.Physics, action: np.ndarray) -> None:
    """Sets the controls of the coming control step from a valid action."""
    ctrl = physics.data.ctrl
    ctrl[self._speed_ids] = ws.SET_POINT_SPEED * action[:3]
    if action[3] < 0.0:
      ctrl[self._grip_ids] = FINGER_TRAVEL
    elif action[3] > 0.0:
      ctrl[self._grip_ids] = 0.0


def check_action(action) -> np.ndarray:
  """Clips an action to [-1, 1].

  Raises:
    ValueError: wrong shape, or a value that is NaN.
  """
  action = np.asarray(action, dtype=np.float64)
  if action.shape != (ACTION_SIZE,):
    raise ValueError(
      f"action has shape {action.shape}; valid is ({ACTION_SIZE},): dx, dy, "
      "dz of the set-point and the gripper, each in [-1, 1]"
    )
  # NaN exactly when a term is, or when infinities cancel: the cheapest test.
  if math.isnan(action.sum()):
    raise ValueError(f"action {action} contains NaN; valid values are [-1, 1]")
  return np.clip(action, -1.0, 1.0)
