"""Small parts of every gradient step."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import torch
from torch import nn


def make_optimiser(
  parameters: Sequence[nn.Parameter],
  learning_rate: float,
  weight_decay: float = 0.0,
) -> torch.optim.Optimizer:
  """Adam with torch's defaults, or AdamW if there is a weight decay.

  On a GPU its count of steps is there too, so that steps can be recorded.
  """
  kind = torch.optim.AdamW if weight_decay else torch.optim.Adam
  return kind(
    parameters,
    learning_rate,
    weight_decay=weight_decay,
    fused=True,
    capturable=parameters[0].is_cuda,
  )


def clipped_step(
  optimiser: torch.optim.Optimizer,
  loss: torch.Tensor,
  parameters: Sequence[nn.Parameter],
  max_norm: float,
) -> torch.Tensor:
  """Makes one step down the gradient; returns its norm before clipping.

  The gradient is that of all parameters together; `max_norm` 0: no bound.
  """
  optimiser.zero_grad()
  loss.backward()
  norm = nn.utils.clip_grad_norm_(parameters, max_norm or math.inf)
  optimiser.step()
  return norm.detach()


@contextmanager
def frozen(parameters: Sequence[nn.Parameter]) -> Iterator[None]:
  """Inside, gradients flow through, but not to, these parameters."""
  for parameter in parameters:
    parameter.requires_grad_(False)
  try:
    yield
  finally:
    for parameter in parameters:
      parameter.requires_grad_(True)


def polyak(target: nn.Module, online: nn.Module, share: float) -> None:
  """Moves the target's parameters by `share` of the way to the online ones."""
  targets: list[torch.Tensor] = list(target.parameters())
  sources: list[torch.Tensor] = [p.detach() for p in online.parameters()]
  torch._foreach_lerp_(targets, sources, share)
