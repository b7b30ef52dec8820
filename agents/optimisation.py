"""Steps down a gradient: Adam on parameters that lie flat."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from lfgp_dmc.agents.networks.flat import FlatParameters

_BETAS, _EPSILON = (0.9, 0.999), 1e-8
_MOMENTS = ("exp_avg", "exp_avg_sq")


class Adam:
  """Adam with torch's defaults, or AdamW if there is a weight decay.

  Calls torch's fused step itself: on networks as small as these,
  `torch.optim.Adam` takes longer to find its parameters than to step them. All
  that changes is a tensor, so that steps can be recorded on a GPU.
  """

  def __init__(
    self,
    parameters: FlatParameters,
    learning_rate: float,
    weight_decay: float = 0.0,
    max_gradient_norm: float = 0.0,
  ):
    """`max_gradient_norm` bounds that of all parameters together; 0: none."""
    self.learning_rate = learning_rate
    self._parameters = parameters
    self._weight_decay = weight_decay
    self._max_norm = max_gradient_norm
    values = parameters.values
    self._state = {name: torch.zeros_like(values) for name in _MOMENTS}
    self._state["step"] = torch.zeros((), device=values.device)

  def step(self, loss: torch.Tensor) -> torch.Tensor:
    """Makes one step down the gradient; returns its norm before clipping."""
    gradient = self._parameters.differentiate(loss)
    norm = torch.linalg.vector_norm(gradient)
    too_long = None
    if self._max_norm:  # what the step divides the gradient by
      too_long = ((norm + 1e-6) / self._max_norm).clamp_(min=1.0)
    step = torch._fused_adamw_ if self._weight_decay else torch._fused_adam_
    self._state["step"] += 1
    step(
      [self._parameters.values],
      [gradient],
      [self._state["exp_avg"]],
      [self._state["exp_avg_sq"]],
      [],
      [self._state["step"]],
      lr=self.learning_rate,
      beta1=_BETAS[0],
      beta2=_BETAS[1],
      weight_decay=self._weight_decay,
      eps=_EPSILON,
      amsgrad=False,
      maximize=False,
      grad_scale=too_long,
    )
    self._parameters.refresh()
    return norm

  def state_dict(self) -> dict[str, Any]:
    """Moments and the count of steps."""
    return {k: v.cpu().numpy().copy() for k, v in self._state.items()}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    for name, tensor in self._state.items():
      tensor.copy_(torch.from_numpy(np.array(state[name])))
