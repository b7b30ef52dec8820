"""Behaviour cloning of all intentions: warm starts, and BC itself."""

import math
from collections.abc import Mapping
from typing import Any

import torch

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.demonstration_pool import ExpertBatch
from lfgp_dmc.agents.losses.behaviour_cloning import (
  behaviour_cloning_loss,
  likelihood_loss,
)
from lfgp_dmc.agents.networks.intentions import IntentionNetwork
from lfgp_dmc.agents.optimisation import (
  clipped_step,
  make_optimiser,
  product_dtype,
)

# What is asked of the intentions: the expert's action as their mean, or the
# expert's actions as their distribution.
SQUARED_ERROR, LIKELIHOOD = "squared_error", "likelihood"
LOSSES = (SQUARED_ERROR, LIKELIHOOD)


def cloning_loss(
  name: str,
  mean: torch.Tensor,
  deviation: torch.Tensor,
  action: torch.Tensor,
  weight: torch.Tensor | None = None,
) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
  """The loss by a name in `LOSSES`; see `behaviour_cloning_loss`."""
  if name == LIKELIHOOD:
    return likelihood_loss(mean, deviation, action, weight)
  return behaviour_cloning_loss(mean, action, weight)


class IntentionCloner:
  """Trains trunk and heads of an `IntentionNetwork` on expert pairs alone."""

  def __init__(
    self,
    network: IntentionNetwork,
    learning_rate: float,
    weight_decay: float = 0.0,
    max_gradient_norm: float = math.inf,
    bfloat16: bool = False,
    loss: str = SQUARED_ERROR,
  ):
    """Makes the optimiser.

    Args:
      network: what to train; its trunk is trained if it owns it.
      learning_rate: step size of Adam.
      weight_decay: above 0: AdamW with this decay.
      max_gradient_norm: bound on the gradient's norm.
      bfloat16: compute products in bfloat16.
      loss: a name in `LOSSES`.
    """
    self._network = network
    self._parameters = network.trained_parameters()
    self._optimiser = make_optimiser(
      self._parameters, learning_rate, weight_decay
    )
    self._max_gradient_norm = max_gradient_norm
    self._dtype = product_dtype(bfloat16)
    self._loss = loss
    self._schedule: torch.optim.lr_scheduler.LRScheduler | None = None

  def loss(self, batch: ExpertBatch) -> tuple[torch.Tensor, dict]:
    """The loss of a batch; see `cloning_loss`."""
    mean, deviation = self._network(batch.inputs.to(self._dtype))
    return cloning_loss(self._loss, mean, deviation, batch.action)

  def anneal(self, updates: int) -> None:
    """Lets the step size fall to 0 in so many updates, as a half cosine."""
    self._schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
      self._optimiser, updates
    )

  def update(self, batch: ExpertBatch) -> dict[str, torch.Tensor]:
    """Makes one update.

    Args:
      batch: each task's own pairs.

    Returns:
      The metrics of `cloning_loss`.
    """
    loss, metrics = self.loss(batch)
    if math.isinf(self._max_gradient_norm):
      self._optimiser.zero_grad()
      loss.backward()
      self._optimiser.step()
    else:
      clipped_step(
        self._optimiser, loss, self._parameters, self._max_gradient_norm
      )
    if self._schedule is not None:
      self._schedule.step()
    return metrics

  def state_dict(self) -> dict[str, Any]:
    """The optimiser's moments (the network is the caller's)."""
    return {"optimiser": serialisation.optimiser_state(self._optimiser)}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    serialisation.load_optimiser_state(self._optimiser, state["optimiser"])
