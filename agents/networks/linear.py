"""Linear layers with an explicit generator: single, and stacked by task."""

import functools
import math

import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents.networks.flat import in_products


@functools.cache
def has_bfloat16() -> bool:
  """Whether the CPU has bfloat16 products; else they are emulated, slowly."""
  if not torch.backends.mkldnn.is_available():
    return False
  return torch.ops.mkldnn._is_mkldnn_bf16_supported()


def initialise_(
  parameter: torch.Tensor, fan_in: int, generator: torch.Generator
) -> torch.Tensor:
  """Fills weights or biases within +-1 / sqrt(fan_in), in place."""
  bound = 1.0 / math.sqrt(fan_in)
  with torch.no_grad():
    return parameter.uniform_(-bound, bound, generator=generator)


class Linear(nn.Linear):
  """A `torch.nn.Linear` that computes in its inputs' dtype.

  Parameters stay float32; bfloat16 inputs make the product one of bfloat16.
  """

  def forward(self, inputs: torch.Tensor) -> torch.Tensor:
    """Maps [..., inputs] to [..., outputs]."""
    dtype = inputs.dtype
    return functional.linear(
      inputs, in_products(self.weight, dtype), in_products(self.bias, dtype)
    )


def make_linear(
  inputs: int, outputs: int, generator: torch.Generator
) -> Linear:
  """A `Linear` with torch's default bounds, drawn from `generator`."""
  layer: Linear = nn.utils.skip_init(Linear, inputs, outputs)
  initialise_(layer.weight, inputs, generator)
  initialise_(layer.bias, inputs, generator)
  return layer


class StackedLinear(nn.Module):
  """G linear layers of one shape, applied by one batched product."""

  def __init__(
    self, groups: int, inputs: int, outputs: int, generator: torch.Generator
  ):
    super().__init__()
    self.weight = nn.Parameter(torch.empty(groups, inputs, outputs))
    self.bias = nn.Parameter(torch.empty(groups, 1, outputs))
    initialise_(self.weight, inputs, generator)
    initialise_(self.bias, inputs, generator)

  def forward(self, inputs: torch.Tensor) -> torch.Tensor:
    """Applies layer g to group g, in the inputs' dtype.

    Maps [G, B, I], or [B, I] for the same rows in every group, to [G, B, O].
    """
    bias, weight = (
      in_products(part, inputs.dtype) for part in (self.bias, self.weight)
    )
    if len(weight) == 1:  # a plain product is faster than a batched
      rows = inputs.reshape(-1, inputs.shape[-1])
      return torch.addmm(bias.squeeze(0), rows, weight.squeeze(0))[None]
    if inputs.dim() == 2:
      inputs = inputs.expand(len(weight), *inputs.shape)
    return torch.baddbmm(bias, inputs, weight)

  def one(self, inputs: torch.Tensor, group: int) -> torch.Tensor:
    """Applies layer `group` alone to [B, I]; returns [B, outputs]."""
    dtype = inputs.dtype
    return torch.addmm(
      in_products(self.bias, dtype)[group],
      inputs,
      in_products(self.weight, dtype)[group],
    )
