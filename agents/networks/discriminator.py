"""One discriminator network with a logit a task, high for the expert's."""

from collections.abc import Sequence

import torch

from lfgp_dmc.agents.networks.discriminator_passes import (
  DiscriminatorPasses,
  tanh_layer,
)
from lfgp_dmc.agents.networks.flat import FlatModule, in_products
from lfgp_dmc.agents.networks.linear import make_linear
from lfgp_dmc.agents.networks.trunk import Selection


class Discriminator(FlatModule):
  """(s, a) -> H tanh -> H tanh -> K logits.

  The k-th sigmoid is the probability that a pair comes from the expert of
  task k (the paper's supplement, model architectures).
  """

  def __init__(
    self,
    tasks: int,
    observations: int,
    actions: int,
    hidden: int,
    generator: torch.Generator,
    inputs: str = "state_action",
    masked: Sequence[int] = (),
  ):
    """Sees "state_action" (paper) or "state", but the `masked` of O floats.

    Raises:
      ValueError: that is nothing.
    """
    super().__init__()
    self.sees_action = inputs == "state_action"
    self.selection = Selection(observations, masked)
    size = self.selection.size + (actions if self.sees_action else 0)
    if not size:
      raise ValueError("a discriminator's masked slices hide all that it sees")
    self.first = make_linear(size, hidden, generator)
    self.second = make_linear(hidden, hidden, generator)
    self.output = make_linear(hidden, tasks, generator)

  def join(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Lays out what the discriminator sees, [..., I]."""
    inputs = self.selection(inputs)
    if self.sees_action:
      return torch.cat([inputs, action], dim=-1)
    return inputs

  @torch.no_grad()
  def logits(self, pairs: torch.Tensor) -> torch.Tensor:
    """Of pairs [..., I] (see `join`), float32 [..., K], without gradient."""
    hidden = pairs
    for layer in (self.first, self.second):
      parts = (layer.weight, layer.bias)
      hidden = tanh_layer(hidden, *(in_products(p, pairs.dtype) for p in parts))
    return self.output(hidden).float()

  def logits_and_gradient(
    self, pairs: torch.Tensor, mixed: torch.Tensor, per_task: bool = False
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """What both losses need, in one pass; differentiable by the weights alone.

    The logits [R, K] of pairs [R, I], and the derivative of those of mixed
    pairs [K, N, I] by their input: of the sum of all K (released code), or,
    `per_task`, of task k's for rows [k]. Float32; products have the dtype of
    the pairs.
    """
    logits, gradient = DiscriminatorPasses.apply(
      pairs,
      mixed.flatten(0, 1),
      per_task,
      *(in_products(p, pairs.dtype) for p in self.parameters()),
    )
    return logits, gradient.view(mixed.shape)
