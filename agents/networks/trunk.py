"""The shared first layers, and the standardisation of what goes into them."""

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents.networks.linear import make_linear


class Standardiser(nn.Module):
  """Maps raw observations to network inputs: (x - mean) / deviation.

  With a fine scale c, tanh(x / c) follows for every float: what differs by
  millimetres near 0, such as a block from its slot, is told apart there, while
  (x - mean) / deviation tells centimetres. With the absorbing flag of the
  released code's wrapper, a 0 comes last: its episodes end by time alone, so
  that no state is ever absorbing.
  """

  mean: torch.Tensor
  deviation: torch.Tensor

  def __init__(
    self, size: int, absorbing_flag: bool = False, fine_scale: float = 0.0
  ):
    """Starts as the identity, what the fine scale adds apart.

    Args:
      size: O, floats of an observation.
      absorbing_flag: whether inputs get one more float, 0.
      fine_scale: c, in the observations' own units; 0: no fine floats.
    """
    super().__init__()
    self.absorbing_flag = absorbing_flag
    self.fine_scale = fine_scale
    self.register_buffer("mean", torch.zeros(size))
    self.register_buffer("deviation", torch.ones(size))

  def fit(self, observation: np.ndarray, floor: float) -> None:
    """Takes mean and deviation from demonstrations.

    Args:
      observation: [N, O].
      floor: smallest deviation used, in the observation's own units; it keeps
        floats that hardly move from being blown up.
    """
    mean = observation.mean(0, dtype=np.float64)
    deviation = np.maximum(observation.std(0, dtype=np.float64), floor)
    self.mean.copy_(torch.from_numpy(mean))
    self.deviation.copy_(torch.from_numpy(deviation))

  def forward(self, observation: torch.Tensor) -> torch.Tensor:
    """Returns [..., input_size]: standardised, fine, flag."""
    inputs = (observation - self.mean) / self.deviation
    if self.fine_scale:
      fine = torch.tanh(observation / self.fine_scale)
      inputs = torch.cat([inputs, fine], dim=-1)
    if self.absorbing_flag:
      inputs = functional.pad(inputs, (0, 1))
    return inputs

  @property
  def input_size(self) -> int:
    """Floats that a network gets: O, or 2 O, and 1 more with the flag."""
    size = self.mean.shape[0]
    return size + size * bool(self.fine_scale) + self.absorbing_flag


class Trunk(nn.Module):
  """Two layers with ReLU, O -> H -> H, shared by all tasks."""

  def __init__(self, inputs: int, hidden: int, generator: torch.Generator):
    """Draws both layers.

    Args:
      inputs: O, floats of an observation.
      hidden: H, units of each layer.
      generator: source of the initial numbers.
    """
    super().__init__()
    self.first = make_linear(inputs, hidden, generator)
    self.second = make_linear(hidden, hidden, generator)

  def forward(self, inputs: torch.Tensor) -> torch.Tensor:
    """Maps inputs [..., O] to features [..., H]."""
    return self.second(self.first(inputs).relu_()).relu_()
