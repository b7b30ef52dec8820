"""The intentions: a trunk and one policy head a task (low-level policies)."""

import math

import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.flat import FlatModule
from lfgp_dmc.agents.networks.linear import StackedLinear
from lfgp_dmc.agents.networks.trunk import Standardiser


class IntentionHeads(nn.Module):
  """K heads -> H ReLU (once or twice) -> 2A: mean and raw std."""

  def __init__(
    self,
    tasks: int,
    features: int,
    hidden: int,
    actions: int,
    generator: torch.Generator,
    hidden_layers: int = 1,
  ):
    super().__init__()
    self.hidden = StackedLinear(tasks, features, hidden, generator)
    self.second = None
    if hidden_layers == 2:
      self.second = StackedLinear(tasks, hidden, hidden, generator)
    self.output = StackedLinear(tasks, hidden, 2 * actions, generator)

  def forward(
    self, features: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Mean and std before the tanh, float32 [K, B, A] each.

    Features are [B, H], the same rows in every task, or [K, B, H].
    """
    hidden = self.hidden(features).relu_()
    if self.second is not None:
      hidden = self.second(hidden).relu_()
    mean, raw = self.output(hidden).float().chunk(2, dim=-1)
    return mean, to_std(raw)

  def set_std(self, std: float) -> None:
    """Gives all intentions one std, before the tanh, whatever the input."""
    actions = self.output.weight.shape[-1] // 2
    raw = math.log(math.expm1(std))  # softplus(raw) = std
    with torch.no_grad():
      self.output.weight[..., actions:] = 0.0
      self.output.bias[..., actions:] = raw

  def one(
    self, features: torch.Tensor, task: int
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """One task's Gaussian for features [B, H]: mean, raw std [B, A]."""
    hidden = self.hidden.one(features, task).relu_()
    if self.second is not None:
      hidden = self.second.one(hidden, task).relu_()
    mean, raw = self.output.one(hidden, task).chunk(2, dim=-1)
    return mean, raw


def to_std(raw: torch.Tensor) -> torch.Tensor:
  """A standard deviation, with the paper's epsilon against underflow."""
  return functional.softplus(raw) + 1e-7


class IntentionNetwork(FlatModule):
  """All that acting needs: standardisation, trunk, heads, any encoder."""

  def __init__(
    self,
    standardiser: Standardiser,
    trunk: nn.Module,
    heads: IntentionHeads,
    owns_trunk: bool,
    encoder: Encoder | None = None,
  ):
    """Without `owns_trunk`, the trunk is the critics': they alone train it."""
    super().__init__()
    self.encoder = encoder
    self.standardiser = standardiser
    self.trunk = trunk
    self.heads = heads
    self.owns_trunk = owns_trunk

  def trained_parameters(self) -> list[nn.Parameter]:
    """The parameters that the intentions' losses train."""
    trunk = list(self.trunk.parameters()) if self.owns_trunk else []
    seen = self.encoder.parameters() if self.encoder is not None else ()
    return [
      *trunk,
      *self.heads.parameters(),
      *(p for p in seen if p.requires_grad),
    ]

  def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Mean and std [K, B, A] for inputs [B, O] or [K, B, O]."""
    with torch.set_grad_enabled(self.owns_trunk and torch.is_grad_enabled()):
      features = self.trunk(inputs)
    return self.heads(features)
