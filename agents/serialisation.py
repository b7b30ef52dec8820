"""States as nested dicts of NumPy arrays and JSON-able values."""

from collections.abc import Mapping

import numpy as np
import torch
from torch import nn

from lfgp_dmc.agents import fields


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
  shapes = {name: tuple(tensor.shape) for name, tensor in own.items()}
  fields.check_arrays(state, shapes, what)
  module.load_state_dict(
    {name: torch.from_numpy(np.array(state[name])) for name in own}
  )
