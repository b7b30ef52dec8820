"""Terms in the intentions' loss that hold them to what was shown or cloned."""

import torch

from lfgp_dmc.agents import cloning
from lfgp_dmc.agents.demonstration_pool import ExpertBatch
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.networks import LfgpNetworks
from lfgp_dmc.agents.losses.behaviour_cloning import (
  behaviour_cloning_loss,
  divergence_loss,
)
from lfgp_dmc.agents.networks import tanh_gaussian
from lfgp_dmc.agents.networks.intentions import IntentionNetwork

Metrics = dict[str, torch.Tensor]


class CloningTerms:
  """The BC term, on expert rows, and the prior's, on the replay's rows.

  What is near is what `bc_loss` says: the squared error of the mean action, or
  the divergence from the prior's distribution. A term's weight fades by
  `bc_decay` an update and, with `bc_normalise`, is counted in each task's mean
  |Q|, with which the rest of the loss grows.
  """

  def __init__(self, config: LfgpConfig, networks: LfgpNetworks):
    """Keeps what is needed."""
    self._config = config
    self._networks = networks
    self._faded = torch.ones_like(networks.log_temperature[0].detach())

  def fade(self, updates: int) -> None:
    """Lets the weights fade to what they are after so many updates."""
    self._faded.fill_(self._config.bc_decay**updates)

  def __call__(
    self,
    expert: ExpertBatch | None,
    inputs: torch.Tensor,
    mean: torch.Tensor,
    deviation: torch.Tensor,
    q: torch.Tensor,
  ) -> tuple[torch.Tensor | float, Metrics]:
    """Adds up the terms that the config asks for.

    Args:
      expert: each task's own pairs; None: no BC term.
      inputs: [B, O], the replay's rows, in the products' dtype.
      mean: [K, B, A], the intentions' means there, before the tanh.
      deviation: [K, B, A], their standard deviations, likewise.
      q: [2, K, B], the critics' values there; no gradient goes into them.

    Returns:
      Their sum, 0.0 if there is none, and metrics by task.
    """
    config = self._config
    loss: torch.Tensor | float = 0.0
    metrics: Metrics = {}
    if expert is not None and config.bc_weight > 0:
      shown, shown_deviation = self._networks.intentions(
        expert.inputs.to(inputs.dtype)
      )
      weight = self._weight(config.bc_weight, q)
      term, more = cloning.cloning_loss(
        config.bc_loss, shown, shown_deviation, expert.action, weight
      )
      loss, metrics = loss + term, more
    if self._networks.prior is not None:
      with torch.no_grad():
        wanted, wanted_deviation = self._networks.prior(inputs)
      weight = self._weight(config.prior_weight, q)
      if config.bc_loss == cloning.LIKELIHOOD:
        term, more = divergence_loss(
          mean, deviation, wanted, wanted_deviation, weight
        )
      else:
        term, more = behaviour_cloning_loss(mean, torch.tanh(wanted), weight)
      loss = loss + term
      metrics["distance_from_prior"] = more["behaviour_cloning"]
    return loss, metrics

  def _weight(self, weight: float, q: torch.Tensor) -> torch.Tensor:
    """A term's weight in each task, [K]."""
    q = q.detach()
    weights = torch.full_like(q[0, :, 0], weight) * self._faded
    if self._config.bc_normalise:
      weights = weights * torch.minimum(q[0], q[1]).abs().mean(-1)
    return weights


@torch.no_grad()
def entropies(
  network: IntentionNetwork, inputs: torch.Tensor, generator: torch.Generator
) -> torch.Tensor:
  """Estimates each intention's entropy where it is at home.

  Args:
    network: the intentions.
    inputs: [K, N, O], rows of each task's own.
    generator: source of the samples.

  Returns:
    [K], mean -log pi, in nats.
  """
  mean, deviation = network(inputs)
  _, log_prob = tanh_gaussian.draw(mean, deviation, generator)
  return -log_prob.mean(-1)
