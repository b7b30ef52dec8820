"""Bounds on the critics' values, for the value penalty."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

_LEAST = 0.01  # a bound's reward is at least so far from 0


class ValueBounds:
  """The least and greatest reward of a batch, over 1 - gamma.

  Both are running medians over updates.
  """

  def __init__(
    self, tasks: int, window: int, discount: float, device: torch.device
  ):
    """`window`: the updates that medians run over."""
    # The latest last; NaN for updates that have not been made yet.
    self._rows = torch.full((window, 2, tasks), torch.nan, device=device)
    self._horizon = 1.0 / max(1.0 - discount, 1e-8)

  def __call__(
    self, reward: torch.Tensor, value: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """The least possible value [K, 1] and the greatest, [K, 1] or [K, B].

    Takes in a batch: rewards and the first critics' values, [K, B] each.
    """
    low = reward.amin(1).clamp(max=-_LEAST)
    high = reward.amax(1).clamp(min=_LEAST)
    low, high = self._median(torch.stack([low, high]))
    return low[:, None] * self._horizon, high[:, None] * self._horizon

  def state_dict(self) -> dict[str, Any]:
    """The rows that the medians run over."""
    return {"rows": self._rows.cpu().numpy().copy()}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self._rows.copy_(torch.from_numpy(np.array(state["rows"])))

  def _median(self, latest: torch.Tensor) -> torch.Tensor:
    self._rows.copy_(torch.cat([self._rows[1:], latest[None]]))
    return self._rows.nanquantile(0.5, dim=0)
