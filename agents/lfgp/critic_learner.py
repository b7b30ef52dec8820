"""The critics' part of an update: soft Bellman residuals, bounds on values."""

from collections.abc import Callable

import torch

from lfgp_dmc.agents.lfgp.config import CriticConfig
from lfgp_dmc.agents.lfgp.networks import Training
from lfgp_dmc.agents.lfgp.reward_source import LabelledBatch
from lfgp_dmc.agents.losses import Metrics
from lfgp_dmc.agents.losses.critic import (
  critic_loss,
  soft_bellman_target,
  value_penalty_loss,
)
from lfgp_dmc.agents.networks import tanh_gaussian
from lfgp_dmc.agents.optimisation import Adam
from lfgp_dmc.agents.value_bounds import ValueBounds


class CriticLearner:
  """Trains the critics, trunk and heads, towards their targets."""

  def __init__(
    self,
    config: CriticConfig,
    shared: Training,
    bounds: type[ValueBounds] = ValueBounds,
  ):
    """`bounds` are the value penalty's."""
    self._networks, optimiser, self._generator, self._dtype = shared
    self._flat = self._networks.critics.flat
    self.optimiser = Adam(
      self._flat,
      config.learning_rate,
      optimiser.weight_decay,
      optimiser.max_gradient_norm,
    )
    self._config = config
    temperature = self._networks.log_temperature
    self.bounds = bounds(
      len(temperature),
      config.value_penalty_window,
      config.discount,
      temperature.device,
    )

  def update(
    self,
    batch: LabelledBatch,
    following: Callable[[], tuple[torch.Tensor, torch.Tensor]],
  ) -> Metrics:
    """One update of trunk and critics; metrics of losses and values.

    `following` gives what the method of its name returns.
    """
    config, reward = self._config, batch.reward
    q = self._networks.critics(batch.inputs.to(self._dtype), batch.action)
    target = soft_bellman_target(
      reward,
      *following(),
      self._networks.log_temperature.detach().exp(),
      config.discount,
    )
    loss, metrics = critic_loss(q, target, batch.mask)
    if config.value_penalty > 0:
      low, high = self.bounds(reward, q[0].detach())
      penalty, more = value_penalty_loss(
        q, low, high, config.value_penalty, batch.mask
      )
      loss = loss + penalty
      metrics |= more
    norm = self.optimiser.step(loss)
    return metrics | {
      "gradient_norm/critic": norm,
      "reward": reward.mean(1),
      "q_bound": reward.abs().amax(1) / (1 - config.discount + 1e-8),
    }

  def reveal(self, updates: int) -> None:
    """Shows critics and targets what they see after so many `updates`."""
    if self._config.revealed and updates >= self._config.revealed_after:
      self._networks.critics.reveal()
      self._networks.target_critics.reveal()

  def update_targets(self) -> None:
    """Moves the targets by `polyak` of the way to the critics."""
    target = self._networks.target_critics.flat
    target.follow(self._flat, self._config.polyak)

  @torch.no_grad()
  def following(
    self, next_inputs: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """The target critics' values [2, K, B] of fresh actions at [B, O].

    And the actions' log densities [K, B].
    """
    networks = self._networks
    next_inputs = next_inputs.to(self._dtype)
    mean, std = networks.intentions(next_inputs)
    action, log_prob = tanh_gaussian.draw(mean, std, self._generator)
    return networks.target_critics(next_inputs, action), log_prob
