"""The intentions' part of an update, and their temperatures'."""

import torch

from agents.experts import Batch, ExpertBatch
from agents.lfgp.cloning_terms import CloningTerms
from agents.lfgp.config import LfgpConfig
from agents.lfgp.networks import LfgpNetworks
from agents.losses.intention import intention_loss
from agents.losses.temperature import temperature_loss
from agents.networks import tanh_gaussian
from agents.optimisation import (
  clipped_step,
  frozen,
  make_optimiser,
  product_dtype,
)

Metrics = dict[str, torch.Tensor]

_SATURATED = 0.99


class IntentionLearner:
  """Trains intentions and temperatures by what the critics say."""

  def __init__(
    self,
    config: LfgpConfig,
    networks: LfgpNetworks,
    generator: torch.Generator,
  ):
    """Makes the optimisers.

    Args:
      config: settings.
      networks: intentions and temperatures, what to train; and the critics.
      generator: on the networks' device, source of all noise.
    """
    self._config = config
    self._networks = networks
    self._generator = generator
    self._dtype = product_dtype(config.bfloat16)
    self._critic_parameters = list(networks.critics.parameters())
    self._parameters = networks.intentions.trained_parameters()
    self.optimisers = {
      "policy": make_optimiser(
        self._parameters, config.intention_learning_rate, config.weight_decay
      ),
      "temperature": make_optimiser(
        [networks.log_temperature], config.temperature_learning_rate
      ),
    }
    self._cloning_terms = CloningTerms(config, networks)

  def fade(self, updates: int) -> None:
    """Lets the cloning terms fade to what they are after so many updates."""
    self._cloning_terms.fade(updates)

  def with_fresh_actions(self, batch: Batch) -> Batch:
    """Gives each example of success an action of its task's intention."""
    assert batch.owner is not None
    first = len(batch.action) - batch.examples
    with torch.no_grad():
      inputs = batch.inputs[first:].to(self._dtype)
      action, _ = self._draw(*self._networks.intentions(inputs))
    rows = torch.arange(batch.examples, device=action.device)
    own = action[batch.owner[first:], rows]
    return batch._replace(action=torch.cat([batch.action[:first], own]))

  def update(self, inputs: torch.Tensor, expert: ExpertBatch | None) -> Metrics:
    """One update of intentions, then of temperatures.

    Args:
      inputs: [B, O], the replay's.
      expert: each task's own pairs; None: no BC term.

    Returns:
      Metrics of the losses.
    """
    networks = self._networks
    inputs = inputs.to(self._dtype)
    with frozen(self._critic_parameters):
      critic_features = networks.critics.trunk(inputs)
      features = critic_features
      if networks.intentions.owns_trunk:
        features = networks.intentions.trunk(inputs)
      mean, deviation = networks.intentions.heads(features)
      action, log_prob = self._draw(mean, deviation)
      q = networks.critics.heads(critic_features, action)
    loss, metrics = intention_loss(
      log_prob, q, networks.log_temperature.detach().exp()
    )
    terms, more = self._cloning_terms(expert, inputs, mean, deviation, q)
    loss, metrics = loss + terms, metrics | more
    norm = clipped_step(
      self.optimisers["policy"],
      loss,
      self._parameters,
      self._config.max_gradient_norm,
    )
    saturated = (action.detach().abs() > _SATURATED).float()
    metrics |= {
      "gradient_norm/policy": norm,
      "saturation": saturated.mean((1, 2)),
    }
    return metrics | self._update_temperatures(log_prob.detach())

  def _update_temperatures(self, log_prob: torch.Tensor) -> Metrics:
    config, parameter = self._config, self._networks.log_temperature
    loss, metrics = temperature_loss(parameter, log_prob, config.target_entropy)
    norm = clipped_step(
      self.optimisers["temperature"],
      loss,
      [parameter],
      config.max_gradient_norm,
    )
    return metrics | {"gradient_norm/temperature": norm}

  def _draw(
    self, mean: torch.Tensor, deviation: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    return tanh_gaussian.draw(mean, deviation, self._generator)
