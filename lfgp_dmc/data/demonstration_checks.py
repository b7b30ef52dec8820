"""Checks of one file of demonstrations: each returns its faults, in words."""

from collections.abc import Mapping
from typing import Any

import numpy as np

SCHEMA_VERSIONS = (1, 2)  # without and with frames
FRAMES = "frames"
COLLECTIONS = ("reset", "play")

# Dataset name -> dtype. The shapes follow from N and the two widths.
DTYPES = {
  "observation": np.dtype(np.float32),
  "action": np.dtype(np.float32),
  "next_observation": np.dtype(np.float32),
  "episode": np.dtype(np.int32),
  "is_last": np.dtype(np.bool_),
}


def of_arrays(
  arrays: Mapping[str, np.ndarray],
  observation_size: int | None,
  action_size: int | None,
  frame_shape: tuple[int, ...] | None = None,
) -> list[str]:
  """Faults of the five arrays, and of frames; None accepts any O, A, frames.

  An empty `frame_shape` accepts none, another one only frames [C, H, W, 3].
  """
  faults = [f"missing dataset {k!r}" for k in DTYPES if k not in arrays]
  faults += [
    f"{name!r} is {arrays[name].dtype}; valid: {dtype}"
    for name, dtype in DTYPES.items()
    if name in arrays and arrays[name].dtype != dtype
  ]
  faults = faults or _wrong_shapes(arrays, observation_size, action_size)
  if frame_shape and FRAMES not in arrays:
    return [*faults, f"has no frames; valid: {list(frame_shape)}"]
  if frame_shape == () and FRAMES in arrays:
    return [*faults, "has frames; valid: none (config.camera_size is 0)"]
  faults = faults or _wrong_values(arrays) + _wrong_episodes(arrays)
  if FRAMES in arrays and not faults:
    return _wrong_frames(arrays[FRAMES], arrays["episode"], frame_shape)
  return faults


def of_attributes(attributes: Mapping[str, Any], task: str | None) -> list[str]:
  """Faults of the attributes; `task` is the expected one (None: any)."""
  faults = [f"missing attribute {k!r}" for k in _VALID if k not in attributes]
  faults += [
    f"{name} is a {type(value).__name__}; valid: a text or a number"
    for name, value in attributes.items()
    if name in _VALID and not isinstance(value, str | int | float | np.number)
  ]
  if faults:
    return faults
  if task is not None and attributes["task"] != task:
    faults.append(f"task is {attributes['task']!r}; expected {task!r}")
  return faults + [
    f"{name} is {attributes[name]!r}; valid: {valid}"
    for name, (is_valid, valid) in _VALID.items()
    if not is_valid(attributes[name])
  ]


def _is_name(value: Any) -> bool:
  return isinstance(value, str) and bool(value)


def _is_number(value: Any, kind: type = np.number) -> bool:
  array = np.asarray(value)
  is_number = not array.shape and np.issubdtype(array.dtype, kind)
  return is_number and bool(np.isfinite(array) and array >= 0)


# Attribute -> its check, and what is valid.
_VALID = {
  "schema_version": (
    lambda v: v in SCHEMA_VERSIONS,
    " or ".join(map(str, SCHEMA_VERSIONS)),
  ),
  "task": (_is_name, "a name"),
  "main_task": (_is_name, "a name"),
  "collection": (lambda v: v in COLLECTIONS, ", ".join(COLLECTIONS)),
  "expert": (_is_name, "a name"),
  "seed": (lambda v: _is_number(v, np.integer), "an integer >= 0"),
  "control_hz": (lambda v: _is_number(v) and v > 0, "a number above 0"),
}


def _wrong_shapes(arrays, observation_size, action_size) -> list[str]:
  shape = arrays["observation"].shape
  rows = shape[0] if shape else 0
  if rows == 0:
    return ["holds no pair; valid: at least one"]
  observation = observation_size or (shape[1] if len(shape) == 2 else "O")
  shape = arrays["action"].shape
  action = action_size or (shape[1] if len(shape) == 2 else "A")
  expected = {
    "observation": (rows, observation),
    "action": (rows, action),
    "next_observation": (rows, observation),
    "episode": (rows,),
    "is_last": (rows,),
  }
  return [
    f"{name!r} has shape {list(arrays[name].shape)}; valid: {list(valid)}"
    for name, valid in expected.items()
    if arrays[name].shape != valid
  ]


def _wrong_values(arrays: Mapping[str, np.ndarray]) -> list[str]:
  faults = []
  for name in ("observation", "action", "next_observation"):
    finite = np.isfinite(arrays[name]).all(axis=1)
    if not finite.all():
      faults.append(
        f"{name!r} has NaN or infinity in {np.sum(~finite)} rows, first in "
        f"row {int(np.argmin(finite))}"
      )
  outside = (np.abs(arrays["action"]) > 1).any(axis=1)
  if outside.any():
    faults.append(
      f"'action' leaves [-1, 1] in {np.sum(outside)} rows, first in row "
      f"{int(np.argmax(outside))}"
    )
  return faults


def _wrong_episodes(arrays: Mapping[str, np.ndarray]) -> list[str]:
  episode, is_last = arrays["episode"], arrays["is_last"]
  faults = []
  if episode[0] < 0 or (np.diff(episode) < 0).any():
    faults.append("'episode' is negative or decreases; valid: 0 0 0 1 1 ...")
  # The row of success ends its episode; an episode cut short has none.
  inside = is_last[:-1] & (episode[1:] == episode[:-1])
  if inside.any():
    faults.append(
      f"'is_last' is true inside an episode, first in row "
      f"{int(np.argmax(inside))}; valid: on an episode's final row only"
    )
  return faults


def _wrong_frames(frames, episode, shape: tuple[int, ...] | None) -> list[str]:
  """Frames are one a row, and one more after each episode's last."""
  rows = len(episode) + len(np.unique(episode))
  found = frames.shape
  wanted = shape or found[1:]
  if frames.dtype != np.uint8:
    return [f"{FRAMES!r} is {frames.dtype}; valid: uint8"]
  if len(wanted) != 4 or wanted[3] != 3 or found != (rows, *wanted):
    valid = [rows, *(shape or ("C", "H", "W", 3))]
    return [
      f"{FRAMES!r} has shape {list(found)}; valid: {valid}, one a pair and one "
      "more an episode"
    ]
  return []
