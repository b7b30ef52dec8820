"""Parameters end to end in one tensor, and their copies for products.

An update then steps, clips, casts and follows in one operation each, however
many layers there are.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import torch
from torch import nn

_COPY = "in_products"  # attribute of a parameter


class FlatParameters:
  """The parameters of an optimiser or of a target, as views of one tensor."""

  def __init__(self, parameters: Sequence[nn.Parameter], dtype: torch.dtype):
    """Moves the parameters, on their final device, into one tensor.

    `dtype` is that of products: float32, or bfloat16, of which there is then a
    copy. Whoever writes to parameters by other means refreshes it.
    """
    flat = torch.cat([p.detach().flatten() for p in parameters])
    trained = parameters[0].requires_grad
    self.values, self.gradient = flat, torch.zeros_like(flat)
    self._sizes = [p.numel() for p in parameters]
    self._leaves: list[torch.Tensor] = list(parameters)
    self._copy = self._by_copy = None
    for parameter, value, gradient in self._parts(flat, self.gradient):
      parameter.data, parameter.grad = value, gradient
    if dtype != flat.dtype:
      self._copy, self._by_copy = flat.to(dtype), flat.to(dtype)
      for parameter, value, gradient in self._parts(self._copy, self._by_copy):
        setattr(parameter, _COPY, value.requires_grad_(trained))
        value.grad = gradient
      self._leaves = [getattr(p, _COPY) for p in parameters]

  def _parts(self, *whole: torch.Tensor):
    """Each parameter, and its parts of the tensors."""
    split = (tensor.split(self._sizes) for tensor in whole)
    for parameter, *parts in zip(self._leaves, *split, strict=True):
      yield parameter, *(part.view_as(parameter) for part in parts)

  def backward(self, loss: torch.Tensor) -> torch.Tensor:
    """The loss's gradient, float32 [P], by parameters and copies together."""
    self.gradient.zero_()
    if self._by_copy is not None:
      self._by_copy.zero_()
    loss.backward()
    if self._by_copy is not None:
      self.gradient += self._by_copy
    return self.gradient

  @contextmanager
  def frozen(self) -> Iterator[None]:
    """Inside, gradients flow through, but not to, these parameters."""
    for leaf in self._leaves:
      leaf.requires_grad_(False)
    try:
      yield
    finally:
      for leaf in self._leaves:
        leaf.requires_grad_(True)

  def refresh(self) -> None:
    """Casts the values anew for products."""
    if self._copy is not None:
      self._copy.copy_(self.values)

  def follow(self, online: "FlatParameters", share: float) -> None:
    """Moves the values by `share` of the way to the online ones."""
    self.values.lerp_(online.values, share)
    self.refresh()


class FlatModule(nn.Module):
  """A network whose parameters lie in `flat` once it is flattened."""

  flat: FlatParameters

  def flatten(self, dtype: torch.dtype) -> None:
    """Lays the trained parameters out, for products of the dtype."""
    self.flat = FlatParameters(self.trained_parameters(), dtype)

  def trained_parameters(self) -> list[nn.Parameter]:
    """All that its own optimiser trains."""
    return list(self.parameters())


def in_products(parameter: torch.Tensor, dtype: torch.dtype) -> torch.Tensor:
  """A parameter as products of the dtype take it."""
  return parameter if parameter.dtype == dtype else getattr(parameter, _COPY)
