"""Arrangements of the blocks at an episode's start; every goal has one."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.snapshot import Snapshot


@dataclass(frozen=True)
class BlockStart:
  """One arrangement."""

  # Green's pose from blue's and from one sampled on the floor, float [7] each.
  place_green: Callable[[np.ndarray, np.ndarray], np.ndarray]
  is_settled: Callable[[Snapshot], bool]  # blocks at rest are arranged so
  # Goals with `is_penalised_off_tray` lose reward unless green lies flat.
  penalises_green: bool = False


def _are_flat(state: Snapshot) -> bool:
  return max(state.blue[2], state.green[2]) < ws.FLAT_Z + 0.005


def _on_top(blue: np.ndarray, sampled: np.ndarray) -> np.ndarray:
  """Over blue's centre, at the sampled yaw."""
  height = blue[2] + 2 * ws.BLOCK_HALF + ws.START_CLEARANCE
  return np.array([*blue[:2], height, *sampled[3:]])


def _is_green_on_blue(state: Snapshot) -> bool:
  return abs(state.green[2] - state.blue[2] - 2 * ws.BLOCK_HALF) < 0.001


APART = BlockStart(lambda blue, sampled: sampled, _are_flat)
GREEN_ON_BLUE = BlockStart(_on_top, _is_green_on_blue, penalises_green=True)
