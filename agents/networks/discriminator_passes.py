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

# Below: R rows with logits, M mixed rows with an input gradient, I inputs,
# H hidden units, K logits. x -> tanh -> first -> tanh -> second -> logits.

_ALIGNED = 16  # products with a row length off this waste up to half their time


def tanh_(value: torch.Tensor) -> torch.Tensor:
  """Tanh as 2 sigmoid(2 x) - 1: a fifth of tanh's time on a CPU.

  In float32, which keeps the digits that the difference would cost bfloat16;
  a float32 tensor is overwritten.
  """
  wide = value if value.dtype == torch.float32 else value.float()
  return wide.mul_(2).sigmoid_().mul_(2).sub_(1).to(value.dtype)


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
    first = tanh_(torch.addmm(bias_1, inputs, weight_1.t()))
    second = tanh_(torch.addmm(bias_2, first, weight_2.t()))
    logits = torch.addmm(bias_3, second[:rows], weight_3.t())
    slope_1, slope_2 = _slope(first), _slope(second)
    output = _output_weight(weight_3, per_task)
    by_second = (_blocks(slope_2[rows:], output) * output).flatten(0, 1)
    by_first_out = by_second @ weight_2
    by_first = by_first_out * slope_1[rows:]
    gradient = by_first @ weight_1
    ctx.per_task = per_task
    ctx.save_for_backward(
      inputs, first, second, slope_1, slope_2, by_second, by_first_out,
      by_first, weight_1, weight_2, weight_3,
    )  # fmt: skip
    return logits.float(), gradient[:, :width].float()

  @staticmethod
  @once_differentiable
  def backward(ctx: Any, *by: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
    """Takes the losses' derivatives by logits and gradient to the weights."""
    (inputs, first, second, slope_1, slope_2, by_second, by_first_out,
     by_first, weight_1, weight_2, weight_3) = ctx.saved_tensors  # fmt: skip
    by_logits = by[0].to(inputs.dtype)
    rows, width = len(by_logits), by[1].shape[1]
    filling = (0, inputs.shape[1] - width)
    by_gradient = functional.pad(by[1].to(inputs.dtype), filling)
    # Back through the input gradient's own computation, last step first.
    back_1 = by_gradient @ weight_1.t()
    through_1 = back_1 * slope_1[rows:]
    back_2 = through_1 @ weight_2.t()
    curved_1 = back_1.mul_(by_first_out).mul_(first[rows:])
    output = _output_weight(weight_3, ctx.per_task)
    by_output = _blocks(back_2 * slope_2[rows:], output).sum(1)
    # Back through both layers, pairs and mixed rows together.
    before_2 = torch.empty_like(second)
    torch.mm(by_logits, weight_3, out=before_2[:rows])
    curved_2 = torch.mul(back_2, second[rows:], out=before_2[rows:])
    _blocks(curved_2, output).mul_(-2 * output)
    before_2.mul_(slope_2)
    before_1 = before_2 @ weight_2
    before_1[rows:].add_(curved_1, alpha=-2)
    before_1.mul_(slope_1)
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


def _slope(value: torch.Tensor) -> torch.Tensor:
  """1 - value^2, the derivative of a tanh, rounded once."""
  return torch.ones_like(value).addcmul_(value, value, value=-1)


def _output_weight(weight: torch.Tensor, per_task: bool) -> torch.Tensor:
  """What the gradient starts from: [K, 1, H], or [1, 1, H] of all logits."""
  return weight[:, None] if per_task else weight.sum(0)[None, None]


def _blocks(rows: torch.Tensor, output: torch.Tensor) -> torch.Tensor:
  """Views rows [M, H] as the blocks of `output`, [K or 1, M / K or M, H]."""
  return rows.view(len(output), -1, rows.shape[1])
