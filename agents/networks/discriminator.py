"""One discriminator network with a logit a task, high for the expert's."""

import torch
from torch import nn
from torch.nn import functional

from agents.networks.linear import make_linear

INPUTS = ("state_action", "state")


class Discriminator(nn.Module):
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
  ):
    """Draws all layers.

    Args:
      tasks: K.
      observations: O.
      actions: A.
      hidden: H, units of each hidden layer.
      generator: source of the initial numbers.
      inputs: "state_action" (paper) or "state": the action is not shown.
    """
    super().__init__()
    self.sees_action = inputs == "state_action"
    size = observations + (actions if self.sees_action else 0)
    self.first = make_linear(size, hidden, generator)
    self.second = make_linear(hidden, hidden, generator)
    self.output = make_linear(hidden, tasks, generator)

  def join(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Lays out what the discriminator sees, [..., I]."""
    if self.sees_action:
      return torch.cat([inputs, action], dim=-1)
    return inputs

  def forward(self, pairs: torch.Tensor) -> torch.Tensor:
    """Maps pairs [..., I] (see `join`) to logits, float32 [..., K]."""
    hidden = torch.tanh(self.first(pairs))
    return self.output(torch.tanh(self.second(hidden))).float()

  def input_gradient(
    self, pairs: torch.Tensor, per_task: bool = False
  ) -> torch.Tensor:
    """The logits' derivative by the input, itself differentiable.

    Written out by hand, so that its own derivative by the weights is plain
    backpropagation.

    Args:
      pairs: [K, N, I], the rows of each task.
      per_task: False: of the sum of all K logits (released code). True: of
        task k's logit for rows [k].

    Returns:
      float32 [K, N, I].
    """
    first = torch.tanh(self.first(pairs))
    second = torch.tanh(self.second(first))
    weight = self.output.weight  # [K, H]
    weight = weight[:, None] if per_task else weight.sum(0)
    gradient = (1 - second * second) * weight
    gradient = functional.linear(gradient, self.second.weight.t())
    gradient = gradient * (1 - first * first)
    return functional.linear(gradient, self.first.weight.t()).float()
