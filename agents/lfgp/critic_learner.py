"""The critics' part of an update: soft Bellman residuals, bounds on values."""

from collections.abc import Mapping
from typing import Any

import torch

from agents.experts import Batch
from agents.lfgp.config import LfgpConfig
from agents.lfgp.networks import LfgpNetworks
from agents.losses.critic import (
  critic_loss,
  soft_bellman_target,
  value_penalty_loss,
)
from agents.networks import tanh_gaussian
from agents.optimisation import clipped_step, make_optimiser, product_dtype
from agents.value_bounds import ValueBounds

Metrics = dict[str, torch.Tensor]


class CriticLearner:
  """Trains the critics, trunk and heads, towards their targets."""

  def __init__(
    self,
    config: LfgpConfig,
    networks: LfgpNetworks,
    generator: torch.Generator,
  ):
    """Makes the optimiser.

    Args:
      config: settings.
      networks: critics, what to train; their targets and the intentions.
      generator: on the networks' device, source of all noise.
    """
    self.parameters = list(networks.critics.parameters())
    self.optimiser = make_optimiser(
      self.parameters, config.critic_learning_rate, config.weight_decay
    )
    self._config = config
    self._networks = networks
    self._generator = generator
    device = networks.log_temperature.device
    self._tasks = torch.arange(len(networks.log_temperature), device=device)
    self._dtype = product_dtype(config.bfloat16)
    self._bounds = ValueBounds(
      len(self._tasks), config.value_penalty_window, config.discount, device
    )

  def update(self, batch: Batch, reward: torch.Tensor) -> Metrics:
    """One update of trunk and critics.

    Args:
      batch: B transitions.
      reward: [K, B].

    Returns:
      Metrics of the losses, and bounds on values.
    """
    config = self._config
    target = self._target(batch, reward)
    q = self._networks.critics(batch.inputs.to(self._dtype), batch.action)
    mask = None
    if batch.owner is not None:  # an example serves its own task alone
      own = batch.owner == self._tasks[:, None]
      mask = ((batch.owner < 0) | own).float()
    loss, metrics = critic_loss(q, target, mask)
    if config.value_penalty > 0:
      low, high = self._value_bounds(batch, reward, q[0].detach())
      penalty, more = value_penalty_loss(
        q, low, high, config.value_penalty, mask
      )
      loss = loss + penalty
      metrics |= more
    norm = clipped_step(
      self.optimiser, loss, self.parameters, config.max_gradient_norm
    )
    return metrics | {
      "gradient_norm/critic": norm,
      "reward": reward.mean(1),
      "q_bound": reward.abs().amax(1) / (1 - config.discount + 1e-8),
    }

  @torch.no_grad()
  def _target(self, batch: Batch, reward: torch.Tensor) -> torch.Tensor:
    """What values should be, [K, B]."""
    networks = self._networks
    next_inputs = batch.next_inputs.to(self._dtype)
    mean, deviation = networks.intentions(next_inputs)
    action, log_prob = tanh_gaussian.draw(mean, deviation, self._generator)
    return soft_bellman_target(
      reward,
      networks.target_critics(next_inputs, action),
      log_prob,
      networks.log_temperature.exp(),
      self._config.discount,
    )

  def _value_bounds(
    self, batch: Batch, reward: torch.Tensor, q: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """The least and greatest possible values, [K, 1] and [K, 1] or [K, B]."""
    if batch.owner is None:
      return self._bounds.of_rewards(reward)
    own = batch.owner == self._tasks[:, None]
    return self._bounds.of_examples(q, own, self._config.reward_scale)

  def state_dict(self) -> dict[str, Any]:
    """The values' bounds (networks and optimiser are the caller's)."""
    return self._bounds.state_dict()

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self._bounds.load_state_dict(state)
