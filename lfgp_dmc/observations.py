"""The layout of the 59 floats that all tasks and agents share.

The order is the released code's, so that published data line up. Observations
also carry `success/<task>` and `condition/<task>`, which are not of the 59.

From pixels, flat observations are the 18 floats that a robot senses, then the
frames of all cameras, [C, H, W, 3], as floats 0 to 255.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

OBSERVATION_SIZE = 59


class Component(NamedTuple):
  """Where a component of the paper's observation table sits in the 59."""

  slices: tuple[slice, ...]
  unit: str
  privileged: bool  # True: needs the simulator's state, not a robot's sensors

  @property
  def size(self) -> int:
    """Number of floats."""
    return sum(part.stop - part.start for part in self.slices)


def _component(*bounds: tuple[int, int], unit: str, privileged: bool):
  slices = tuple(slice(start, stop) for start, stop in bounds)
  return Component(slices, unit, privileged)


# Name -> where, unit, privileged (the paper's table "obs_details"). Where a
# component is in several slices, blue's part comes first, then green's.
OBSERVATION_SLICES: dict[str, Component] = {
  "ee_position": _component((0, 3), unit="m", privileged=False),
  "ee_velocity": _component((3, 6), unit="m/s", privileged=False),
  # Two fingers each: now, two steps ago, one step ago; 0 closed, 1 open.
  "finger_positions": _component((6, 12), unit="1", privileged=False),
  "block_positions": _component((12, 15), (19, 22), unit="m", privileged=True),
  "block_rotations": _component(
    (15, 19), (22, 26), unit="quaternion w x y z", privileged=True
  ),
  "block_linear_velocities": _component(
    (26, 29), (32, 35), unit="m/s", privileged=True
  ),
  "block_angular_velocities": _component(
    (29, 32), (35, 38), unit="rad/s", privileged=True
  ),
  "blocks_from_ee": _component((38, 44), unit="m", privileged=True),
  "green_from_blue": _component((44, 47), unit="m", privileged=True),
  "slots_from_blocks": _component((47, 53), unit="m", privileged=True),
  # tanh(F / 100 N), tanh(T / 10 N m), at the wrist.
  "force_torque": _component((53, 59), unit="tanh", privileged=False),
}

CAMERA_PREFIX = "camera/"
SUCCESS_PREFIX = "success/"
CONDITION_PREFIX = "condition/"
REWARD_PREFIX = "reward/"  # of a task; see `acting/environments.py`


# What a robot senses by itself.
PROPRIOCEPTION = tuple(
  name for name, part in OBSERVATION_SLICES.items() if not part.privileged
)

# The components one after the other: where each starts and ends, where in the
# 59 each of its floats is, and the way back.
_BOUNDS: dict[str, slice] = {}
_end = 0
for _name, _part in OBSERVATION_SLICES.items():
  _BOUNDS[_name] = slice(_end, _end + _part.size)
  _end += _part.size
_GROUPED = np.concatenate(
  [np.r_[part.slices] for part in OBSERVATION_SLICES.values()]
)
_FLAT = np.argsort(_GROUPED)


def components(flat: np.ndarray) -> dict[str, np.ndarray]:
  """Splits float32 [59] into the named components; the inverse of `flatten`."""
  grouped = flat[_GROUPED]
  return {name: grouped[bounds] for name, bounds in _BOUNDS.items()}


def flatten(observation: Mapping[str, np.ndarray]) -> np.ndarray:
  """Lays the named observables out in the order of the released code.

  Args:
    observation: a timestep's observation with all eleven components.

  Returns:
    float32 [59]; of vision, which leaves the privileged ones out, see
    `flatten_vision`.

  Raises:
    KeyError: a component is missing.
    TypeError: it is another thing, such as the whole timestep.
  """
  _check(observation)
  if not has_state(observation) and any(map(is_frame, observation)):
    return flatten_vision(observation)
  try:
    parts = [observation[name] for name in _BOUNDS]
  except KeyError as error:
    raise KeyError(
      f"observation lacks {error}; the 59 floats need "
      f"{', '.join(OBSERVATION_SLICES)} (observations='features')"
    ) from None
  return np.concatenate(parts, dtype=np.float32)[_FLAT]


def _check(observation: Any) -> None:
  if not isinstance(observation, Mapping):
    raise TypeError(
      f"observation is a {type(observation).__name__}; valid: the named "
      "observables, timestep.observation"
    )


def has_state(observation: Mapping[str, Any]) -> bool:
  """Whether all eleven components are there, the privileged ones too."""
  return OBSERVATION_SLICES.keys() <= observation.keys()


def flatten_vision(observation: Mapping[str, np.ndarray]) -> np.ndarray:
  """What the robot senses, then the pixels, float32 [18 + C H W 3]."""
  parts = [*map(observation.__getitem__, PROPRIOCEPTION)]
  parts += [np.ravel(v) for k, v in observation.items() if is_frame(k)]
  return np.concatenate(parts, dtype=np.float32)


def is_frame(name: str) -> bool:
  """Whether an observable of this name is a camera's frame."""
  return name.startswith(CAMERA_PREFIX)


def successes(observation: Mapping[str, np.ndarray]) -> dict[str, bool]:
  """Task -> has it succeeded (held long enough) since the episode began."""
  return _flags(observation, SUCCESS_PREFIX)


def conditions(observation: Mapping[str, np.ndarray]) -> dict[str, bool]:
  """Task -> does its success condition hold at this instant."""
  return _flags(observation, CONDITION_PREFIX)


def _flags(observation, prefix: str) -> dict[str, bool]:
  _check(observation)
  return {
    key.removeprefix(prefix): bool(value)
    for key, value in observation.items()
    if key.startswith(prefix)
  }
