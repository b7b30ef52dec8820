"""A regulariser of the policy loss: distance from a frozen prior."""

from collections.abc import Sequence

import numpy as np
import torch
from absl import logging

from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp.config import PriorConfig
from lfgp_dmc.agents.losses import Metrics
from lfgp_dmc.agents.losses.behaviour_cloning import (
  behaviour_cloning_loss,
  divergence_loss,
)
from lfgp_dmc.agents.networks import tanh_gaussian
from lfgp_dmc.agents.networks.intentions import IntentionNetwork

_ENTROPY_ROWS = 1024  # a task


class Prior:
  """The first intentions, and the weighted distance from them.

  The weight decays with every update and, if normalised, counts in each task's
  mean |Q|, with which the rest of the loss grows.
  """

  def __init__(
    self, config: PriorConfig, network: IntentionNetwork, device: torch.device
  ):
    self._config = config
    self._network = network
    self._faded = torch.ones((), device=device)

  def adopt(self, intentions: IntentionNetwork) -> None:
    """Copies the current intentions into the prior."""
    self._network.load_state_dict(intentions.state_dict())
    self._network.flat.refresh()

  def fade(self, updates: int) -> None:
    """Decays the weight to its value after `updates`."""
    self._faded.fill_(self._config.decay**updates)

  def warn_if_precise(
    self,
    tasks: Sequence[str],
    experts: ExpertPool | None,
    target_entropy: float,
  ) -> None:
    """Names the tasks whose prior has less entropy than the target.

    Their temperatures would grow without bound, since the divergence holds the
    intentions at the prior's entropy.
    """
    if experts is None or self._config.distance != "divergence":
      return
    rows = experts.sample(np.random.default_rng(0), _ENTROPY_ROWS).inputs
    noise = torch.Generator(rows.device).manual_seed(0)
    values = entropies(self._network, rows, noise).tolist()
    for task, value in zip(tasks, values, strict=True):
      if value < target_entropy:
        logging.warning(
          "the intention of %s starts with an entropy of %.1f nats, where its "
          "prior holds it; target_entropy is %.1f, so that its temperature "
          "will grow without bound: choose a lower one",
          task,
          value,
          target_entropy,
        )

  def __call__(
    self,
    inputs: torch.Tensor,
    mean: torch.Tensor,
    std: torch.Tensor,
    q: torch.Tensor,
  ) -> tuple[torch.Tensor, Metrics]:
    """The weighted distance, and the unweighted one by task.

    At the replay's inputs [B, O]: the intentions' mean and std [K, B, A] before
    the tanh, and the critics' values [2, K, B], without gradient.
    """
    with torch.no_grad():
      prior_mean, prior_std = self._network(inputs)
    weight = (self._config.weight * self._faded).expand(len(mean))
    if self._config.normalise:
      weight = weight * torch.minimum(q[0], q[1]).abs().mean(-1)
    if self._config.distance == "divergence":
      loss, metrics = divergence_loss(mean, std, prior_mean, prior_std, weight)
    else:
      loss, metrics = behaviour_cloning_loss(
        mean, torch.tanh(prior_mean), weight
      )
    return loss, {"distance_from_prior": metrics["behaviour_cloning"]}


@torch.no_grad()
def entropies(
  network: IntentionNetwork, inputs: torch.Tensor, generator: torch.Generator
) -> torch.Tensor:
  """Each intention's mean -log pi, [K], on its own task's rows [K, N, O]."""
  mean, std = network(inputs)
  _, log_prob = tanh_gaussian.draw(mean, std, generator)
  return -log_prob.mean(-1)
