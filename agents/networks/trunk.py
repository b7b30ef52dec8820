"""The shared first layers, and the standardisation of what goes into them."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import nn

from lfgp_dmc.agents.networks.linear import make_linear

# Floor on the std used, in the observation's unit: floats that hardly move are
# not blown up.
_STD_FLOOR = 0.01


class Standardiser(nn.Module):
  """Maps raw observations to network inputs: (x - mean) / std.

  With a tanh feature scale c, tanh(x / c) follows for every float: it resolves
  millimetres near 0, such as a block in its slot, where (x - mean) / std
  resolves centimetres.
  """

  mean: torch.Tensor
  deviation: torch.Tensor  # the std, by its name in stored policies

  def __init__(self, size: int, tanh_feature_scale: float = 0.0):
    """Starts as the identity on O floats; c is in their units, 0: none."""
    super().__init__()
    self.tanh_feature_scale = tanh_feature_scale
    self.register_buffer("mean", torch.zeros(size))
    self.register_buffer("deviation", torch.ones(size))

  def fit(self, observation: np.ndarray) -> None:
    """Takes mean and std, at least 0.01, from demonstrations [N, O].

    Of fewer floats than O, the others (an encoder's features) stay as they are.
    """
    size = observation.shape[1]
    mean = observation.mean(0, dtype=np.float64)
    std = np.maximum(observation.std(0, dtype=np.float64), _STD_FLOOR)
    self.mean[:size].copy_(torch.from_numpy(mean))
    self.deviation[:size].copy_(torch.from_numpy(std))

  def forward(self, observation: torch.Tensor) -> torch.Tensor:
    """Returns [..., input_size]: standardised, then tanh features."""
    inputs = (observation - self.mean) / self.deviation
    if self.tanh_feature_scale:
      features = torch.tanh(observation / self.tanh_feature_scale)
      inputs = torch.cat([inputs, features], dim=-1)
    return inputs

  @property
  def input_size(self) -> int:
    """Floats that a network gets: O, or 2 O with tanh features."""
    return len(self.mean) * (2 if self.tanh_feature_scale else 1)


class Selection(nn.Module):
  """The inputs of a network that is not to see all of them, or not yet."""

  seen: torch.Tensor  # int64 [S], places among the inputs
  shown: torch.Tensor  # [S], 0 until `reveal`, else 1

  def __init__(
    self, inputs: int, masked: Sequence[int] = (), revealed: Sequence[int] = ()
  ):
    """Leaves out `masked` of so many inputs; `revealed` ones are 0 at first."""
    super().__init__()
    left = sorted({*range(inputs)} - {*masked})
    seen = torch.tensor(left, dtype=torch.int64)  # also if there are none
    self.register_buffer("seen", seen, persistent=False)
    self.size = len(seen)
    self.sees_all = self.size == inputs
    self.reveals = len(revealed) > 0
    shown = torch.isin(seen, torch.tensor(revealed), invert=True).float()
    self.register_buffer("shown", shown, persistent=False)

  def reveal(self) -> None:
    """From now on, all that are not masked are seen."""
    self.shown.fill_(1)

  def forward(self, inputs: torch.Tensor) -> torch.Tensor:
    """Maps inputs [..., I] to those that are seen, [..., S]."""
    if not self.sees_all:
      inputs = inputs.index_select(-1, self.seen)
    return inputs * self.shown.to(inputs.dtype) if self.reveals else inputs


class Trunk(nn.Module):
  """Two layers with ReLU, O -> H -> H, shared by all tasks."""

  def __init__(self, inputs: int, hidden: int, generator: torch.Generator):
    super().__init__()
    self.first = make_linear(inputs, hidden, generator)
    self.second = make_linear(hidden, hidden, generator)

  def forward(self, inputs: torch.Tensor) -> torch.Tensor:
    """Maps inputs [..., O] to features [..., H]."""
    return self.second(self.first(inputs).relu_()).relu_()
