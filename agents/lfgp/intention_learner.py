"""The intentions' part of an update, and their temperatures'."""

import torch

from lfgp_dmc.agents.lfgp.config import IntentionConfig
from lfgp_dmc.agents.lfgp.networks import Training
from lfgp_dmc.agents.lfgp.prior import Prior
from lfgp_dmc.agents.losses import Metrics
from lfgp_dmc.agents.losses.intention import intention_loss, temperature_loss
from lfgp_dmc.agents.networks import tanh_gaussian
from lfgp_dmc.agents.networks.flat import FlatParameters
from lfgp_dmc.agents.optimisation import Adam

_SATURATED = 0.99


class IntentionLearner:
  """Trains intentions and temperatures by the critics' values."""

  def __init__(
    self, config: IntentionConfig, shared: Training, prior: Prior | None
  ):
    self._networks, optimiser, self._generator, self._dtype = shared
    self.target_entropy = config.target_entropy
    max_norm = optimiser.max_gradient_norm
    self._prior = prior
    self.optimisers = {
      "policy": Adam(
        self._networks.intentions.flat,
        config.learning_rate,
        optimiser.weight_decay,
        max_norm,
      ),
      "temperature": Adam(
        FlatParameters([self._networks.log_temperature], torch.float32),
        config.temperature_learning_rate,
        max_gradient_norm=max_norm,
      ),
    }

  def update(self, inputs: torch.Tensor) -> Metrics:
    """One update of intentions, then of temperatures, on inputs [B, O]."""
    networks = self._networks
    inputs = inputs.to(self._dtype)
    critic_features = networks.critics.trunk(inputs)
    features = critic_features
    if networks.intentions.owns_trunk:
      features = networks.intentions.trunk(inputs)
    mean, std = networks.intentions.heads(features)
    action, log_prob = tanh_gaussian.draw(mean, std, self._generator)
    q = networks.critics.heads(critic_features, action)
    loss, metrics = intention_loss(
      log_prob, q, networks.log_temperature.detach().exp()
    )
    if self._prior is not None:
      term, more = self._prior(inputs, mean, std, q.detach())
      loss, metrics = loss + term, metrics | more
    norm = self.optimisers["policy"].step(loss)
    saturated = (action.detach().abs() > _SATURATED).float()
    metrics |= {
      "gradient_norm/policy": norm,
      "saturation": saturated.mean((1, 2)),
    }
    return metrics | self._update_temperatures(log_prob.detach())

  def _update_temperatures(self, log_prob: torch.Tensor) -> Metrics:
    parameter = self._networks.log_temperature
    loss, metrics = temperature_loss(parameter, log_prob, self.target_entropy)
    norm = self.optimisers["temperature"].step(loss)
    return metrics | {"gradient_norm/temperature": norm}
