"""States as nested dicts of NumPy arrays and JSON-able values."""

from collections.abc import Mapping
from typing import Any

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


def optimiser_state(optimiser: torch.optim.Optimizer) -> dict[str, Any]:
  """An optimiser's moments: parameter index (as str) -> name -> array."""
  state = optimiser.state_dict()["state"]
  return {
    str(index): {
      name: value.detach().cpu().numpy().copy() for name, value in entry.items()
    }
    for index, entry in state.items()
  }


def load_optimiser_state(
  optimiser: torch.optim.Optimizer, state: Mapping[str, Any]
) -> None:
  """Restores what `optimiser_state` returned; settings stay as built."""
  moments = {
    int(index): {
      name: torch.from_numpy(np.array(value)) for name, value in entry.items()
    }
    for index, entry in state.items()
  }
  groups = optimiser.state_dict()["param_groups"]
  optimiser.load_state_dict({"state": moments, "param_groups": groups})
