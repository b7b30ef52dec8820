"""Parameters end to end in one tensor, and their copies for products.

An update then steps, clips, casts and follows in one operation each, however
many layers there are.
"""

import itertools
from collections.abc import Sequence

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
    self.values = torch.cat([p.detach().flatten() for p in parameters])
    self.gradient = torch.zeros_like(self.values)  # [P], their `grad`
    self._parameters = list(parameters)
    self._copy = None
    self._copies: list[torch.Tensor] = []
    self._places = self._parts(self.gradient)
    for parameter, value, gradient in zip(
      parameters, self._parts(self.values), self._places, strict=True
    ):
      parameter.data, parameter.grad = value, gradient
    if dtype != self.values.dtype:
      self._copy = self.values.to(dtype)
      self._copies = self._parts(self._copy)
      for parameter, copy in zip(parameters, self._copies, strict=True):
        copy.requires_grad_(parameter.requires_grad)
        setattr(parameter, _COPY, copy)

  def _parts(self, whole: torch.Tensor) -> list[torch.Tensor]:
    """Each parameter's part of a tensor [P]."""
    parts = whole.split([p.numel() for p in self._parameters])
    pairs = zip(parts, self._parameters, strict=True)
    return [part.view_as(parameter) for part, parameter in pairs]

  def differentiate(self, loss: torch.Tensor) -> torch.Tensor:
    """The loss's gradient by these parameters alone, float32 [P].

    Of each, products use the copy or float32 operations itself, never both.
    """
    leaves = [*self._parameters, *self._copies]
    found = torch.autograd.grad(loss, leaves, allow_unused=True)
    own, by_copy = found[: len(self._places)], found[len(self._places) :]
    for place, *parts in itertools.zip_longest(self._places, own, by_copy):
      part = next((part for part in parts if part is not None), None)
      place.zero_() if part is None else place.copy_(part)
    return self.gradient

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
