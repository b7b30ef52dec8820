"""The discriminator's training passes, written out by hand.

One forward pass serves the logits of real pairs and the derivative, by its
input, of mixed ones; the backward pass shares its products between the two.
Autograd takes the same derivatives (a test holds them together) but keeps more
and multiplies more.
"""

from typing import Any

import torch
from torch.autograd.function import once_differentiable
from torch.nn import functional

from lfgp_dmc.agents.networks.linear import has_bfloat16

# Below: R rows with logits, M mixed rows with an input gradient, I inputs,
# H hidden units, K logits. x -> tanh -> first -> tanh -> second -> logits.

_ALIGNED = 16  # products with a row length off this waste up to half their time

_tanh_backward = torch.ops.aten.tanh_backward  # (by, tanh): by (1 - tanh^2)


def tanh_layer(
  inputs: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor
) -> torch.Tensor:
  """tanh(inputs weight^T + bias), without a gradient.

  In float32 as 2 sigmoid(2 x) - 1: some CPUs' tanh takes five times as long. In
  bfloat16 in one operation, if the CPU has one, which rounds once.
  """
  if inputs.dtype == torch.float32:
    double = torch.addmm(bias, inputs, weight.t(), beta=2, alpha=2)
    return double.sigmoid_().mul_(2).sub_(1)
  if inputs.is_cpu and has_bfloat16():
    own = torch.ops.mkldnn
    return own._linear_pointwise(inputs, weight, bias, "tanh", [], "")
  return torch.addmm(bias, inputs, weight.t()).tanh_()


class DiscriminatorPasses(torch.autograd.Function):
  """(pairs [R, I], mixed [M, I], weights) -> logits [R, K], gradient [M, I].

  The gradient is that of the sum of all logits, or with `per_task`, where rows
  come in K equal blocks, of logit k in block k.
  """

  @staticmethod
  def forward(
    ctx: Any,
    pairs: torch.Tensor,
    mixed: torch.Tensor,
    per_task: bool,
    *parameters: torch.Tensor,
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """Computes in the dtype of `pairs`; float32 results."""
    rows, width = pairs.shape
    weight_1, bias_1, weight_2, bias_2, weight_3, bias_3 = parameters
    filling = (0, -width % _ALIGNED)
    weight_1 = functional.pad(weight_1, filling)
    inputs = functional.pad(torch.cat([pairs, mixed]), filling)
    first = tanh_layer(inputs, weight_1, bias_1)
    second = tanh_layer(first, weight_2, bias_2)
    logits = torch.addmm(bias_3, second[:rows], weight_3.t())
    output = _output_weight(weight_3, per_task)
    mixed_2 = _blocks(second[rows:], output)
    by_second = _tanh_backward(output.expand_as(mixed_2), mixed_2).flatten(0, 1)
    by_first_out = by_second @ weight_2
    by_first = _tanh_backward(by_first_out, first[rows:])
    gradient = by_first @ weight_1
    ctx.per_task = per_task
    ctx.save_for_backward(
      inputs, first, second, by_second, by_first_out, by_first,
      weight_1, weight_2, weight_3,
    )  # fmt: skip
    return logits.float(), gradient[:, :width].float()

  @staticmethod
  @once_differentiable
  def backward(ctx: Any, *by: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
    """Takes the losses' derivatives by logits and gradient to the weights."""
    (inputs, first, second, by_second, by_first_out, by_first,
     weight_1, weight_2, weight_3) = ctx.saved_tensors  # fmt: skip
    by_logits = by[0].to(inputs.dtype)
    rows, width = len(by_logits), by[1].shape[1]
    filling = (0, inputs.shape[1] - width)
    by_gradient = functional.pad(by[1].to(inputs.dtype), filling)
    # Back through the input gradient's own computation, last step first.
    back_1 = by_gradient @ weight_1.t()
    through_1 = _tanh_backward(back_1, first[rows:])
    back_2 = through_1 @ weight_2.t()
    curved_1 = back_1.mul_(by_first_out).mul_(first[rows:])
    output = _output_weight(weight_3, ctx.per_task)
    by_output = _blocks(_tanh_backward(back_2, second[rows:]), output).sum(1)
    # Back through both layers, pairs and mixed rows together.
    before_2 = torch.empty_like(second)
    torch.mm(by_logits, weight_3, out=before_2[:rows])
    curved_2 = torch.mul(back_2, second[rows:], out=before_2[rows:])
    _blocks(curved_2, output).mul_(-2 * output)
    before_2 = _tanh_backward(before_2, second)
    before_1 = before_2 @ weight_2
    before_1[rows:].add_(curved_1, alpha=-2)
    before_1 = _tanh_backward(before_1, first)
    by_weight_1 = torch.addmm(before_1.t() @ inputs, by_first.t(), by_gradient)
    gradients = (
      by_weight_1[:, :width],
      before_1.sum(0),
      torch.addmm(before_2.t() @ first, by_second.t(), through_1),
      before_2.sum(0),
      by_logits.t() @ second[:rows] + by_output,
      by_logits.sum(0),
    )
    return (None, None, None, *gradients)


def _output_weight(weight: torch.Tensor, per_task: bool) -> torch.Tensor:
  """What the gradient starts from: [K, 1, H], or [1, 1, H] of all logits."""
  return weight[:, None] if per_task else weight.sum(0)[None, None]


def _blocks(rows: torch.Tensor, output: torch.Tensor) -> torch.Tensor:
  """Views rows [M, H] as the blocks of `output`, [K or 1, M / K or M, H]."""
  return rows.view(len(output), -1, rows.shape[1])
