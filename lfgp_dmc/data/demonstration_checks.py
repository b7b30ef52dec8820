"""Checks of one file of demonstrations: each says in words what it finds."""

from collections.abc import Mapping
from typing import Any

import numpy as np

_FAINT = 0.2  # largest |a| that suggests another unit

SCHEMA_VERSION = 1
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
) -> list[str]:
  """Faults of the five arrays; a size of None accepts any O or A."""
  faults = [f"missing dataset {k!r}" for k in DTYPES if k not in arrays]
  faults += [
    f"{name!r} is {arrays[name].dtype}; valid: {dtype}"
    for name, dtype in DTYPES.items()
    if name in arrays and arrays[name].dtype != dtype
  ]
  faults = faults or _wrong_shapes(arrays, observation_size, action_size)
  return faults or _wrong_values(arrays) + _wrong_episodes(arrays)


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


def doubts(arrays: Mapping[str, np.ndarray]) -> list[str]:
  """What is accepted of the five arrays but seldom meant."""
  found = []
  if not arrays["is_last"].any():
    found.append("no row of success ('is_last')")
  largest = np.abs(arrays["action"]).max(axis=0)
  if (largest < _FAINT).any():
    found.append(
      f"|a| stays below {_FAINT} in dimension {np.argmin(largest)}: is the "
      "action in units of its bound?"
    )
  if rows := jumps(arrays):
    found.append(
      f"{len(rows)} rows do not start where the row before ended, first row "
      f"{rows[0]}"
    )
  return found


def jumps(arrays: Mapping[str, np.ndarray]) -> list[int]:
  """Rows that do not start where the row before, of their attempt, ended."""
  same = arrays["episode"][1:] == arrays["episode"][:-1]
  before, after = arrays["next_observation"][:-1], arrays["observation"][1:]
  return list(1 + np.flatnonzero(same & (before != after).any(axis=1)))


def _is_name(value: Any) -> bool:
  return isinstance(value, str) and bool(value)


def _is_number(value: Any, kind: type = np.number) -> bool:
  array = np.asarray(value)
  is_number = not array.shape and np.issubdtype(array.dtype, kind)
  return is_number and bool(np.isfinite(array) and array >= 0)


# Attribute -> its check, and what is valid.
_VALID = {
  "schema_version": (lambda v: v == SCHEMA_VERSION, SCHEMA_VERSION),
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
