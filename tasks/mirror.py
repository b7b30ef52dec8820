"""Mirror images of demonstrations: left of the tray's middle becomes right.

Tray, slots, workspace, starts and the experts' behaviour are symmetric about
the plane y = 0.5: an attempt's mirror image is another attempt, from a start
that nobody had to demonstrate.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from lfgp_dmc.data import demonstrations
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.observations import OBSERVATION_SIZE, OBSERVATION_SLICES
from lfgp_dmc.tasks import workspace as ws

# Signs by component. A reflection flips one axis of a vector, and the other two
# of a pseudovector: rotation axes, angular velocities, torques.
_VECTOR = (1, -1, 1)
_PSEUDO = (-1, 1, -1)
_SIGNS: dict[str, tuple[int, ...]] = {
  "ee_position": _VECTOR,
  "ee_velocity": _VECTOR,
  "finger_positions": (1,) * 6,
  "block_positions": _VECTOR * 2,
  "block_rotations": (1, *_PSEUDO) * 2,
  "block_linear_velocities": _VECTOR * 2,
  "block_angular_velocities": _PSEUDO * 2,
  "blocks_from_ee": _VECTOR * 2,
  "green_from_blue": _VECTOR,
  "slots_from_blocks": _VECTOR * 2,
  "force_torque": (*_VECTOR, *_PSEUDO),  # the hand's y is the world's, or -y
}
_POSITIONS = ("ee_position", "block_positions")  # whose y is not an offset


def _columns(name: str) -> np.ndarray:
  """A component's places in the 59."""
  return np.r_[OBSERVATION_SLICES[name].slices]


_SIGN = np.empty(OBSERVATION_SIZE, np.float32)
_SHIFT = np.zeros(OBSERVATION_SIZE, np.float32)
_ORDER = np.arange(OBSERVATION_SIZE)
for _name, _signs in _SIGNS.items():
  _SIGN[_columns(_name)] = _signs
for _name in _POSITIONS:
  _SHIFT[_columns(_name)[1::3]] = 2 * ws.CENTRE_XY[1]
_fingers = _columns("finger_positions")
_ORDER[_fingers] = _fingers.reshape(-1, 2)[:, ::-1].ravel()  # left is right
_ACTION_SIGN = np.array([*_VECTOR, 1], np.float32)


def observation(flat: np.ndarray) -> np.ndarray:
  """The mirror image of observations, float32 [..., 59]."""
  return _SIGN * flat[..., _ORDER] + _SHIFT


def action(flat: np.ndarray) -> np.ndarray:
  """The mirror image of actions, float32 [..., 4]."""
  return _ACTION_SIGN * flat


def with_images(
  found: Mapping[str, Demonstrations],
) -> dict[str, Demonstrations]:
  """Every task's demonstrations followed by their mirror images.

  The images' attempts have numbers of their own. Move-Object's expert goes
  round one way, and images would go round the other way from the same states:
  it has none.
  """
  return {
    task: data if task == "move_object" else _with_images(data)
    for task, data in found.items()
  }


def _with_images(data: Demonstrations) -> Demonstrations:
  images = dataclasses.replace(
    data,
    observation=observation(data.observation),
    action=action(data.action),
    next_observation=observation(data.next_observation),
  )
  return demonstrations.joined([data, images])
