"""Behaviour cloning of all intentions: pretraining, and BC itself."""

from collections.abc import Mapping
from typing import Any

import torch

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.batches import ExpertBatch
from lfgp_dmc.agents.fields import OptimiserConfig
from lfgp_dmc.agents.losses.behaviour_cloning import (
  behaviour_cloning_loss,
  likelihood_loss,
)
from lfgp_dmc.agents.networks.intentions import IntentionNetwork
from lfgp_dmc.agents.optimisation import clipped_step, make_optimiser


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
    self._parameters = network.trained_parameters()
    self._optimiser = make_optimiser(
      self._parameters, learning_rate, config.weight_decay
    )
    self._max_gradient_norm = config.max_gradient_norm
    self._dtype = dtype
    self._loss = loss
    self._schedule: torch.optim.lr_scheduler.LRScheduler | None = None

  def anneal(self, updates: int) -> None:
    """Anneals the step size to 0 over the updates, by a half cosine."""
    self._schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
      self._optimiser, updates
    )

  def update(self, batch: ExpertBatch) -> dict[str, torch.Tensor]:
    """Makes one update on each task's own pairs; the loss's metrics."""
    mean, std = self._network(batch.inputs.to(self._dtype))
    loss, metrics = cloning_loss(self._loss, mean, std, batch.action)
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
