"""States as nested dicts of NumPy arrays and JSON-able values."""

from collections.abc import Mapping

import numpy as np
import torch
from torch import nn


def module_state(module: nn.Module) -> dict[str, np.ndarray]:
  """A module's parameters and buffers by name, copied."""
  return {
    name: tensor.detach().cpu().numpy().copy()
    for name, tensor in module.state_dict().items()
  }


def load_module_state(
  module: nn.Module, state: Mapping[str, np.ndarray], what: str
) -> None:
  """Copies arrays by name into a module, in place.

  Raises:
    ValueError: names or shapes differ, or a number is not finite; the
      message starts with `what` and lists each fault.
  """
  own = module.state_dict()
  faults = [f"{name} is missing" for name in own if name not in state]
  faults += [f"{name} is not known" for name in state if name not in own]
  faults += [
    f"{name} has shape {list(state[name].shape)}, not {list(tensor.shape)}"
    for name, tensor in own.items()
    if name in state and tuple(state[name].shape) != tuple(tensor.shape)
  ]
  faults += [
    f"{name} holds numbers that are not finite"
    for name in own
    if name in state and not np.isfinite(state[name]).all()
  ]
  if faults:
    raise ValueError(f"{what}: {'; '.join(faults)}")
  module.load_state_dict(
    {name: torch.from_numpy(np.array(state[name])) for name in own}
  )
