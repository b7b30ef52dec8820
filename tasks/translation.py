"""Copies of demonstrations elsewhere in the plane.

The tray is flat, and no slot matters to any task but Bring and Insert: an
attempt that is shifted as a whole is another attempt, from a start that nobody
had to demonstrate.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from lfgp_dmc.data import demonstrations
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.observations import OBSERVATION_SLICES
from lfgp_dmc.tasks import workspace as ws

_REACH = 0.08  # m, the greatest shift along x and y
_PINNED = ("bring", "insert")  # their slots stay where they are


def _in_plane(name: str) -> np.ndarray:
  """The places of a component's x and y in the 59, [positions, 2]."""
  return np.r_[OBSERVATION_SLICES[name].slices].reshape(-1, 3)[:, :2]


_POSITIONS = np.concatenate(
  [_in_plane("ee_position"), _in_plane("block_positions")]
)
_TO_SLOTS = _in_plane("slots_from_blocks")
_LOW = np.array(ws.SET_POINT_LOW[:2], np.float32)
_HIGH = np.array(ws.SET_POINT_HIGH[:2], np.float32)


def observation(flat: np.ndarray, shift: np.ndarray) -> np.ndarray:
  """Observations float32 [N, 59], each by its own shift [N, 2], m."""
  moved = flat.copy()
  moved[:, _POSITIONS] += shift[:, None]
  moved[:, _TO_SLOTS] -= shift[:, None]
  return moved


def with_copies(
  found: Mapping[str, Demonstrations],
  copies: int,
  generator: np.random.Generator,
) -> dict[str, Demonstrations]:
  """Every task's demonstrations followed by shifted copies of them.

  Each copy of an attempt has one shift, uniform within 8 cm along x and y, less
  where TCP or blocks would leave the box of the set-point; its number is its
  own. Bring and Insert have no copies. Move-Object's expert circles about the
  tray's middle; its copies circle elsewhere, and succeed too.
  """
  return {
    task: data if task in _PINNED else _with_copies(data, copies, generator)
    for task, data in found.items()
  }


def _with_copies(
  data: Demonstrations, copies: int, generator: np.random.Generator
) -> Demonstrations:
  _, starts, attempt = np.unique(
    data.episode, return_index=True, return_inverse=True
  )
  rows = np.stack([data.observation, data.next_observation])
  visited = rows[:, :, _POSITIONS]  # [2, N, 3, 2]
  lowest = np.minimum.reduceat(visited.min((0, 2)), starts)
  highest = np.maximum.reduceat(visited.max((0, 2)), starts)
  low = np.clip(_LOW - lowest, -_REACH, 0)
  high = np.clip(_HIGH - highest, 0, _REACH)
  parts = [data]
  for _ in range(copies):
    shift = generator.uniform(low, high).astype(np.float32)[attempt]
    parts.append(
      dataclasses.replace(
        data,
        observation=observation(data.observation, shift),
        next_observation=observation(data.next_observation, shift),
      )
    )
  return demonstrations.joined(parts)
