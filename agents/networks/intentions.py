"""The intentions: a trunk and one policy head a task (low-level policies)."""

import math

import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents.networks.linear import StackedLinear
from lfgp_dmc.agents.networks.trunk import Standardiser

STD_FLOOR = 1e-7  # the paper's epsilon against underflow


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
    """Draws all heads; `features` is the trunk's width, layers are 1 or 2."""
    super().__init__()
    self.hidden = StackedLinear(tasks, features, hidden, generator)
    self.second = None
    if hidden_layers == 2:
      self.second = StackedLinear(tasks, hidden, hidden, generator)
    self.output = StackedLinear(tasks, hidden, 2 * actions, generator)

  def forward(
    self, features: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Every intention's Gaussian, before the tanh.

    Args:
      features: [B, H] for the same rows in every task, or [K, B, H].

    Returns:
      Mean and standard deviation, float32 [K, B, A] each.
    """
    hidden = self.hidden(features).relu_()
    if self.second is not None:
      hidden = self.second(hidden).relu_()
    return split(self.output(hidden))

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
  """softplus(raw) + 1e-7: a standard deviation, with no other clamp."""
  return functional.softplus(raw) + STD_FLOOR


def split(output: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
  """Splits a head's [..., 2A] into mean and std, float32 [..., A]."""
  mean, raw = output.float().chunk(2, dim=-1)
  return mean, to_std(raw)


class IntentionNetwork(nn.Module):
  """All that acting needs: standardisation, trunk, heads."""

  def __init__(
    self,
    standardiser: Standardiser,
    trunk: nn.Module,
    heads: IntentionHeads,
    owns_trunk: bool,
  ):
    """Puts the parts together; the trunk may be the critics' own module.

    Args:
      standardiser: raw observation -> input.
      trunk: input -> features; see `layouts.py`.
      heads: features -> Gaussians.
      owns_trunk: whether losses of the intentions train the trunk. False: it
        is the critics', and no gradient of ours reaches it.
    """
    super().__init__()
    self.standardiser = standardiser
    self.trunk = trunk
    self.heads = heads
    self.owns_trunk = owns_trunk

  def trained_parameters(self) -> list[nn.Parameter]:
    """The parameters that the intentions' losses train."""
    trunk = list(self.trunk.parameters()) if self.owns_trunk else []
    return [*trunk, *self.heads.parameters()]

  def features(self, inputs: torch.Tensor) -> torch.Tensor:
    """Features [..., H] of standardised inputs [..., O]."""
    if self.owns_trunk:
      return self.trunk(inputs)
    with torch.no_grad():
      return self.trunk(inputs)

  def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Mean and std [K, B, A] for inputs [B, O] or [K, B, O]."""
    return self.heads(self.features(inputs))
