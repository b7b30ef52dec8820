"""Bounds on the critics' values, for the value penalty."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

_LEAST = 0.01  # a bound's reward is at least so far from 0


class ValueBounds:
  """Running medians over updates of what bounds each task's values.

  With rewards from a discriminator or stored ones, the least and the greatest
  reward of a batch, over 1 - gamma. With examples of success, the bounds
  follow from the rewards -1 and +1, but for the rows of the replay: theirs is
  the value that the examples have now.
  """

  def __init__(
    self, tasks: int, window: int, discount: float, device: torch.device
  ):
    """Starts without a median.

    Args:
      tasks: K.
      window: updates that the medians run over.
      discount: gamma.
      device: where to compute.
    """
    # The latest last; NaN for updates that have not been made yet.
    self._rows = torch.full((window, 2, tasks), torch.nan, device=device)
    self._horizon = 1.0 / max(1.0 - discount, 1e-8)

  def of_rewards(
    self, reward: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Takes a batch's rewards in.

    Args:
      reward: [K, B].

    Returns:
      The least and the greatest possible value, [K, 1] each.
    """
    low = reward.amin(1).clamp(max=-_LEAST)
    high = reward.amax(1).clamp(min=_LEAST)
    low, high = self._median(torch.stack([low, high]))
    return low[:, None] * self._horizon, high[:, None] * self._horizon

  def of_examples(
    self, value: torch.Tensor, own: torch.Tensor, scale: float
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Takes the examples' values in.

    Args:
      value: [K, B], the first critics', without gradient.
      own: bool [K, B], whether a row is the task's own example.
      scale: the reward of an example; that of all else is -scale.

    Returns:
      The least possible value [K, 1] and the greatest [K, B].
    """
    mean = (value * own).sum(1) / own.sum(1)
    high = self._median(torch.stack([mean, mean]))[0]
    most = torch.full_like(value, scale * self._horizon)
    return -most[:, :1], torch.where(own, most, high[:, None])

  def state_dict(self) -> dict[str, Any]:
    """The rows that the medians run over."""
    return {"rows": self._rows.cpu().numpy().copy()}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self._rows.copy_(torch.from_numpy(np.array(state["rows"])))

  def _median(self, latest: torch.Tensor) -> torch.Tensor:
    self._rows.copy_(torch.cat([self._rows[1:], latest[None]]))
    return self._rows.nanquantile(0.5, dim=0)
