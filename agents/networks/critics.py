"""The twin critics: a trunk and two Q heads a task, stacked in one tensor."""

from collections.abc import Iterator

import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents.networks.flat import FlatModule, in_products
from lfgp_dmc.agents.networks.linear import StackedLinear, initialise_
from lfgp_dmc.agents.networks.trunk import Selection


class TwinCriticHeads(nn.Module):
  """2K heads [features, action] -> H ReLU (once or twice) -> 1.

  The first layer is kept in two parts, for features and for actions, so that
  the derivative by the action alone costs no product with the features' part.
  """

  def __init__(
    self,
    tasks: int,
    features: int,
    hidden: int,
    actions: int,
    generator: torch.Generator,
    layer_norm: bool = False,
    hidden_layers: int = 1,
  ):
    """Layer norm (not in the paper), before the last ReLU, is each head's."""
    super().__init__()
    self.tasks = tasks
    groups, fan_in = 2 * tasks, features + actions
    self.feature_weight = nn.Parameter(torch.empty(groups, features, hidden))
    self.action_weight = nn.Parameter(torch.empty(groups, actions, hidden))
    self.bias = nn.Parameter(torch.empty(groups, 1, hidden))
    for parameter in (self.feature_weight, self.action_weight, self.bias):
      initialise_(parameter, fan_in, generator)
    self.second = None
    if hidden_layers == 2:
      self.second = StackedLinear(groups, hidden, hidden, generator)
    self.output = StackedLinear(groups, hidden, 1, generator)
    self.gain = self.shift = None
    if layer_norm:
      self.gain = nn.Parameter(torch.ones(groups, 1, hidden))
      self.shift = nn.Parameter(torch.zeros(groups, 1, hidden))

  def forward(
    self, features: torch.Tensor, action: torch.Tensor
  ) -> torch.Tensor:
    """Both values of each task for that task's action, float32 [2, K, B].

    Features are [B, H], the same rows in every task, and products have their
    dtype; actions are [B, A], the same in every task, or [K, B, A].
    """
    groups, rows = 2 * self.tasks, features.shape[0]
    dtype = features.dtype
    action = action.to(dtype)
    if action.dim() == 3:
      action = action.repeat(2, 1, 1)
    hidden = torch.baddbmm(
      in_products(self.bias, dtype),
      features.expand(groups, *features.shape),
      in_products(self.feature_weight, dtype),
    )
    hidden.baddbmm_(  # in place: nobody needs the sum without it
      action.expand(groups, rows, action.shape[-1]),
      in_products(self.action_weight, dtype),
    )
    if self.second is not None:
      hidden = self.second(hidden.relu_())
    if self.gain is not None and self.shift is not None:
      hidden = functional.layer_norm(hidden, hidden.shape[-1:])
      hidden = torch.addcmul(
        in_products(self.shift, dtype), hidden, in_products(self.gain, dtype)
      )
    value = _single_outputs(hidden.relu_(), self.output)
    return value.float().reshape(2, self.tasks, rows)


def _single_outputs(hidden: torch.Tensor, layer: StackedLinear) -> torch.Tensor:
  """The one output of each group, [G, B], of hidden [G, B, H].

  A float32 product of matrix and vector takes six times as long as this on a
  CPU; in bfloat16 it does not, and keeps digits that products here would lose.
  """
  if hidden.dtype != torch.float32:
    return layer(hidden)[..., 0]
  weight = layer.weight.transpose(1, 2)  # [G, 1, H]
  return (hidden * weight).sum(-1) + layer.bias[..., 0]


class CriticNetwork(FlatModule):
  """Trunk and twin heads: the target network is a copy of the whole."""

  def __init__(self, trunk: nn.Module, heads: TwinCriticHeads):
    super().__init__()
    self.trunk = trunk
    self.heads = heads

  def forward(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Values [2, K, B] of inputs [B, O] and actions [B, A] or [K, B, A]."""
    return self.heads(self.trunk(inputs), action)

  def reveal(self) -> None:
    """From now on, no input but the masked ones is hidden."""
    for selection in self._selections():
      selection.reveal()

  @torch.no_grad()
  def forget_hidden(self) -> None:
    """Sets weights of inputs that are still hidden to 0 (separate layout).

    So no value jumps when they are revealed.
    """
    for selection in self._selections():
      if selection.reveals:
        self.heads.feature_weight.mul_(selection.shown[:, None])

  def _selections(self) -> Iterator[Selection]:
    return (m for m in self.modules() if isinstance(m, Selection))
