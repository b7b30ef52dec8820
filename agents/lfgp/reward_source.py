"""Where rewards come from: the interface of each source."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import torch

from lfgp_dmc.agents.batches import Batch, Draw
from lfgp_dmc.agents.losses import Metrics
from lfgp_dmc.agents.optimisation import Adam
from lfgp_dmc.agents.value_bounds import ValueBounds
from lfgp_dmc.types import Episode


class LabelledBatch(NamedTuple):
  """A batch with its rewards, for critics and intentions."""

  inputs: torch.Tensor  # [B, O], standardised
  action: torch.Tensor  # [B, A]
  next_inputs: torch.Tensor  # [B, O], standardised
  reward: torch.Tensor  # [K, B]
  # [K, B], 1 where a task's critics learn from a row, else 0; None: all 1.
  mask: torch.Tensor | None = None
  policy_rows: int | None = None  # intentions learn from the first; None: all


class RewardSource:
  """Base of the three sources; by default, nothing is learned."""

  # The kind of bounds on values that follows from its rewards.
  bounds: type[ValueBounds] = ValueBounds

  # By the names used in checkpoints.
  optimisers: Mapping[str, Adam] = MappingProxyType({})

  def update(self, draw: Draw) -> Metrics:
    """Trains the source, where there is something to train; its metrics."""
    del draw
    return {}

  def label(self, batch: Batch) -> LabelledBatch:
    """Gives each row its reward for each task."""
    raise NotImplementedError

  def main_rewards(self, episode: Episode) -> np.ndarray:
    """The main task's reward of each step of an episode, float [T]."""
    raise NotImplementedError
