"""The world's mirror image: what is left of the tray's middle is on its right.

Tray, slots, workspace and starts are the same on both sides of the plane
y = 0.5, and so is what an expert does. An attempt's mirror image is therefore
another attempt, from a start that no one had to show.
"""

from collections.abc import Mapping

import numpy as np

from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.observations import OBSERVATION_SIZE, OBSERVATION_SLICES
from lfgp_dmc.tasks import workspace as ws

# By component: the signs of a vector's floats across the plane, and those of
# what turns (rotations, angular velocities, torques), which flip the others.
_VECTOR = (1, -1, 1)
_TURNING = (-1, 1, -1)
_SIGNS: dict[str, tuple[int, ...]] = {
  "ee_position": _VECTOR,
  "ee_velocity": _VECTOR,
  "finger_positions": (1,) * 6,
  "block_positions": _VECTOR * 2,
  "block_rotations": (1, *_TURNING) * 2,
  "block_linear_velocities": _VECTOR * 2,
  "block_angular_velocities": _TURNING * 2,
  "blocks_from_ee": _VECTOR * 2,
  "green_from_blue": _VECTOR,
  "slots_from_blocks": _VECTOR * 2,
  "force_torque": (*_VECTOR, *_TURNING),  # the hand's y is the world's, or -y
}
_POSITIONS = ("ee_position", "block_positions")  # whose y is not an offset


def _columns(name: str) -> np.ndarray:
  """Where in the 59 a component's floats are."""
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
# Its expert goes round one way; images would show the same states going round
# the other way.
_ONE_WAY = ("move_object",)
_ACTION_SIGN = np.array([*_VECTOR, 1], np.float32)


def observation(flat: np.ndarray) -> np.ndarray:
  """The mirror image of observations, float32 [..., 59]."""
  return _SIGN * flat[..., _ORDER] + _SHIFT


def action(flat: np.ndarray) -> np.ndarray:
  """The mirror image of actions, float32 [..., 4]."""
  return _ACTION_SIGN * flat


def with_images(
  shown: Mapping[str, Demonstrations],
) -> dict[str, Demonstrations]:
  """Every task's demonstrations followed by their mirror images.

  Args:
    shown: task -> demonstrations.

  Returns:
    The same tasks, twice as many pairs; those of Move-Object have no images.
  """
  return {
    task: data if task in _ONE_WAY else _with_images(data)
    for task, data in shown.items()
  }


def _with_images(shown: Demonstrations) -> Demonstrations:
  """Demonstrations followed by their mirror images.

  Args:
    shown: N pairs of a task.

  Returns:
    2 N pairs; the images' attempts have numbers of their own.
  """
  first = shown.episode.max(initial=-1) + 1
  images: dict[str, np.ndarray] = {
    "observation": observation(shown.observation),
    "action": action(shown.action),
    "next_observation": observation(shown.next_observation),
    "episode": shown.episode + first,
    "is_last": shown.is_last,
  }
  both = {
    name: np.concatenate([array, images[name]])
    for name, array in shown.arrays().items()
  }
  return Demonstrations(**both, attributes=shown.attributes)
