"""Behaviour cloning of all intentions: pretraining, and BC itself."""

import math
from collections.abc import Mapping
from typing import Any

import torch

from lfgp_dmc.agents.batches import ExpertBatch
from lfgp_dmc.agents.fields import OptimiserConfig
from lfgp_dmc.agents.losses.behaviour_cloning import (
  behaviour_cloning_loss,
  likelihood_loss,
)
from lfgp_dmc.agents.networks.intentions import IntentionNetwork
from lfgp_dmc.agents.optimisation import Adam


def cloning_loss(
  name: str, mean: torch.Tensor, std: torch.Tensor, action: torch.Tensor
) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
  """By name: squared error of the mean action, or likelihood."""
  if name == "likelihood":
    return likelihood_loss(mean, std, action)
  return behaviour_cloning_loss(mean, action)


class IntentionCloner:
  """Trains trunk and heads of an `IntentionNetwork` on expert pairs alone."""

  def __init__(
    self,
    network: IntentionNetwork,
    learning_rate: float,
    config: OptimiserConfig,
    loss: str,
    dtype: torch.dtype,
  ):
    self._network = network
    self._learning_rate = learning_rate
    self._optimiser = Adam(
      network.flat,
      learning_rate,
      config.weight_decay,
      config.max_gradient_norm,
    )
    self._dtype = dtype
    self._loss = loss

  def anneal(self, done: float) -> None:
    """Sets the step size on its half cosine to 0, of which a share is done."""
    share = 0.5 * (1.0 + math.cos(math.pi * done))
    self._optimiser.learning_rate = share * self._learning_rate

  def update(self, batch: ExpertBatch) -> dict[str, torch.Tensor]:
    """Makes one update on each task's own pairs; the loss's metrics."""
    mean, std = self._network(batch.inputs.to(self._dtype))
    loss, metrics = cloning_loss(self._loss, mean, std, batch.action)
    self._optimiser.step(loss)
    return metrics

  def state_dict(self) -> dict[str, Any]:
    """The optimiser's moments (the network is the caller's)."""
    return {"optimiser": self._optimiser.state_dict()}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self._optimiser.load_state_dict(state["optimiser"])
