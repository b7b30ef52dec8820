"""Nested state <-> flat arrays and a JSON tree.

Arrays go to one flat dict under names like `critic/optimizer/0`; in the tree
`{"__array__": name}` keeps their place. Tuples come back as lists.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

_ARRAY = "__array__"


def pack(state: Any) -> tuple[dict[str, np.ndarray], Any]:
  """Splits a nested state into the arrays by flat name and the JSON tree.

  Raises:
    TypeError: a leaf or a key of another type; the message says where.
  """
  arrays: dict[str, np.ndarray] = {}
  return arrays, _pack(state, "", arrays)


def unpack(arrays: Mapping[str, np.ndarray], tree: Any) -> Any:
  """Puts back together what `pack` split.

  Raises:
    KeyError: an array that the tree names is not there.
  """
  if isinstance(tree, list):
    return [unpack(arrays, item) for item in tree]
  if not isinstance(tree, dict):
    return tree
  if tree.keys() == {_ARRAY}:
    return arrays[tree[_ARRAY]]
  return {key: unpack(arrays, value) for key, value in tree.items()}


def flattened(
  values: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, Any]]:
  """Dotted names and values of all leaves, such as of a config."""
  for name, value in values.items():
    if isinstance(value, Mapping):
      yield from flattened(value, f"{prefix}{name}.")
    else:
      yield prefix + name, value


def _pack(value: Any, name: str, arrays: dict[str, np.ndarray]) -> Any:
  if isinstance(value, np.ndarray):
    unique = name
    while unique in arrays:  # "a/b" may be one key, or two
      unique += "_"
    arrays[unique] = value
    return {_ARRAY: unique}
  if isinstance(value, np.generic):
    return value.item()
  if isinstance(value, Mapping):
    if not all(isinstance(key, str) for key in value):
      raise TypeError(f"state {name!r} has keys {[*value]}; valid: text")
    return {
      key: _pack(item, f"{name}/{key}" if name else key, arrays)
      for key, item in value.items()
    }
  if isinstance(value, list | tuple):
    return [_pack(v, f"{name}/{i}", arrays) for i, v in enumerate(value)]
  if value is None or isinstance(value, bool | int | float | str):
    return value
  raise TypeError(
    f"state {name!r} is a {type(value).__name__}; only arrays and JSON values "
    "can be stored"
  )
