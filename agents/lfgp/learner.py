"""One update of all networks, Algorithm 1 of the paper; torch alone."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import nn

from agents import serialisation
from agents.experts import Batch, ExpertBatch
from agents.lfgp.config import LfgpConfig
from agents.lfgp.networks import LfgpNetworks
from agents.losses.behaviour_cloning import behaviour_cloning_loss
from agents.losses.critic import critic_loss, soft_bellman_target
from agents.losses.discriminator import (
  discriminator_loss,
  gradient_penalty_loss,
  mix,
)
from agents.losses.intention import intention_loss
from agents.losses.temperature import temperature_loss
from agents.networks import tanh_gaussian
from agents.optimisation import clipped_step, frozen, make_optimiser, polyak
from agents.rewards import reward_from_logits

Metrics = dict[str, torch.Tensor]

# What `update` reports; the second are [K].
SCALAR_METRICS = (
  "loss/discriminator",
  "loss/gradient_penalty",
  "loss/critic",
  "loss/policy",
  "loss/temperature",
  "loss/behaviour_cloning",
  "gradient_norm/discriminator_input",
  "gradient_norm/critic",
  "gradient_norm/policy",
  "gradient_norm/temperature",
)
TASK_METRICS = (
  "accuracy_expert",
  "accuracy_policy",
  "logit_expert",
  "logit_policy",
  "reward",
  "q",
  "q_max",  # largest |Q| of the batch
  "q_bound",  # largest |reward| of the batch / (1 - gamma)
  "temperature",
  "entropy",
  "saturation",  # share of the intention's action floats beyond 0.99
  "behaviour_cloning",
)
_SATURATED = 0.99


class LfgpLearner:
  """Networks, optimisers and updates; batches are the caller's."""

  def __init__(
    self,
    config: LfgpConfig,
    networks: LfgpNetworks,
    generator: torch.Generator,
  ):
    """Makes the optimisers.

    Args:
      config: settings.
      networks: what to train.
      generator: on the networks' device, source of all noise.
    """
    self.networks = networks
    self.updates = 0
    self._config = config
    self._generator = generator
    self._device = networks.log_temperature.device
    self._critic_parameters = list(networks.critics.parameters())
    self._policy_parameters = networks.intentions.trained_parameters()
    decay = config.weight_decay
    self._optimisers = {
      "discriminator": make_optimiser(
        list(networks.discriminator.parameters()),
        config.discriminator_learning_rate,
        decay,
      ),
      "critic": make_optimiser(
        self._critic_parameters, config.critic_learning_rate, decay
      ),
      "policy": make_optimiser(
        self._policy_parameters, config.intention_learning_rate, decay
      ),
      "temperature": make_optimiser(
        [networks.log_temperature], config.temperature_learning_rate
      ),
    }

  def update(
    self,
    batch: Batch,
    discriminator_batch: Batch | None = None,
    expert: ExpertBatch | None = None,
  ) -> Metrics:
    """One update: discriminator, critics, intentions, temperatures, targets.

    Args:
      batch: B transitions for critics and intentions; their rewards come from
        the discriminator just updated.
      discriminator_batch: other transitions, for the discriminator; None:
        leave it as it is.
      expert: each task's own pairs, for the discriminator and the BC term;
        may be None if neither is wanted.

    Returns:
      Detached tensors by the names above.
    """
    metrics: Metrics = {}
    if discriminator_batch is not None:
      if expert is None:
        raise ValueError("the discriminator's update needs expert pairs")
      metrics |= self.update_discriminator(discriminator_batch, expert)
    reward = self.rewards(batch.inputs, batch.action)
    metrics |= self._update_critics(batch, reward)
    log_prob, policy_metrics = self._update_intentions(batch.inputs, expert)
    metrics |= policy_metrics
    metrics |= self._update_temperatures(log_prob)
    polyak(
      self.networks.target_critics, self.networks.critics, self._config.polyak
    )
    self.updates += 1
    return metrics

  def update_discriminator(self, batch: Batch, expert: ExpertBatch) -> Metrics:
    """One update of the discriminator, penalty included.

    Args:
      batch: transitions of the replay.
      expert: each task's own pairs, [K, N, ...].

    Returns:
      The metrics of both losses.
    """
    config, network = self._config, self.networks.discriminator
    tasks, rows = expert.action.shape[:2]
    policy_pairs = network.join(self._disturb(batch.inputs), batch.action)
    expert_pairs = network.join(self._disturb(expert.inputs), expert.action)
    share = torch.rand(
      expert_pairs.shape, generator=self._generator, device=self._device
    )
    with self._autocast():
      logits = network(torch.cat([policy_pairs, expert_pairs.flatten(0, 1)]))
      gradient = network.input_gradient(
        mix(policy_pairs, expert_pairs, share),
        config.gradient_penalty_per_task,
      )
    policy_rows = policy_pairs.shape[0]
    own = logits[policy_rows:].view(tasks, rows, tasks)
    loss, metrics = discriminator_loss(
      logits[:policy_rows], own.diagonal(dim1=0, dim2=2)
    )
    penalty, more = gradient_penalty_loss(gradient, config.gradient_penalty)
    optimiser = self._optimisers["discriminator"]
    optimiser.zero_grad()
    (loss + penalty).backward()
    optimiser.step()
    return metrics | more

  def rewards(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Every task's reward by the current discriminator.

    Args:
      inputs: [B, O], standardised.
      action: [B, A].

    Returns:
      [K, B], without gradient.
    """
    config, network = self._config, self.networks.discriminator
    with torch.no_grad(), self._autocast():
      logits = network(network.join(inputs, action))
    return reward_from_logits(
      logits.t(), config.reward, config.reward_clip, config.reward_scale
    )

  def _update_critics(self, batch: Batch, reward: torch.Tensor) -> Metrics:
    networks, config = self.networks, self._config
    with torch.no_grad(), self._autocast():
      mean, deviation = networks.intentions(batch.next_inputs)
      action, log_prob = self._sample(mean, deviation)
      next_q = networks.target_critics(batch.next_inputs, action)
      target = soft_bellman_target(
        reward,
        next_q,
        log_prob,
        networks.log_temperature.exp(),
        config.discount,
      )
    with self._autocast():
      q = networks.critics(batch.inputs, batch.action)
    loss, metrics = critic_loss(q, target)
    norm = self._step("critic", loss, self._critic_parameters)
    return metrics | {
      "gradient_norm/critic": norm,
      "reward": reward.mean(1),
      "q_bound": reward.abs().amax(1) / (1 - config.discount + 1e-8),
    }

  def _update_intentions(
    self, inputs: torch.Tensor, expert: ExpertBatch | None
  ) -> tuple[torch.Tensor, Metrics]:
    """Returns the new actions' log densities [K, B], and metrics."""
    networks, config = self.networks, self._config
    with frozen(self._critic_parameters), self._autocast():
      critic_features = networks.critics.trunk(inputs)
      features = critic_features
      if networks.intentions.owns_trunk:
        features = networks.intentions.trunk(inputs)
      mean, deviation = networks.intentions.heads(features)
      action, log_prob = self._sample(mean, deviation)
      q = networks.critics.heads(critic_features, action)
    loss, metrics = intention_loss(
      log_prob, q, networks.log_temperature.detach().exp()
    )
    if expert is not None and config.bc_weight > 0:
      term, more = self._cloning_term(expert, q.detach())
      loss = loss + term
      metrics |= more
    norm = self._step("policy", loss, self._policy_parameters)
    saturated = (action.detach().abs() > _SATURATED).float()
    return log_prob.detach(), metrics | {
      "gradient_norm/policy": norm,
      "saturation": saturated.mean((1, 2)),
    }

  def _cloning_term(
    self, expert: ExpertBatch, q: torch.Tensor
  ) -> tuple[torch.Tensor, Metrics]:
    """The BC term: every task weighs bc_weight, times its mean |Q| if asked."""
    config = self._config
    with self._autocast():
      mean, _ = self.networks.intentions(expert.inputs)
    weight = torch.full_like(
      q[0, :, 0], config.bc_weight * config.bc_decay**self.updates
    )
    if config.bc_normalise:
      weight = weight * torch.minimum(q[0], q[1]).abs().mean(-1)
    return behaviour_cloning_loss(mean, expert.action, weight)

  def _update_temperatures(self, log_prob: torch.Tensor) -> Metrics:
    parameter = self.networks.log_temperature
    loss, metrics = temperature_loss(
      parameter, log_prob, self._config.target_entropy
    )
    norm = self._step("temperature", loss, [parameter])
    return metrics | {"gradient_norm/temperature": norm}

  def _step(
    self, name: str, loss: torch.Tensor, parameters: list[nn.Parameter]
  ) -> torch.Tensor:
    return clipped_step(
      self._optimisers[name], loss, parameters, self._config.max_gradient_norm
    )

  def _sample(
    self, mean: torch.Tensor, deviation: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    return tanh_gaussian.sample(mean, deviation, self._noise(mean))

  def _noise(self, like: torch.Tensor) -> torch.Tensor:
    return torch.randn(
      like.shape, generator=self._generator, device=self._device
    )

  def _disturb(self, inputs: torch.Tensor) -> torch.Tensor:
    """Adds the discriminator's training noise, if any."""
    if not self._config.discriminator_noise:
      return inputs
    return inputs + self._config.discriminator_noise * self._noise(inputs)

  def _autocast(self) -> torch.autocast:
    return torch.autocast(
      self._device.type, torch.bfloat16, enabled=self._config.bfloat16
    )

  def adopt_intention_trunk(self) -> None:
    """Copies the intentions' own trunk into critics and targets."""
    state = self.networks.intentions.trunk.state_dict()
    self.networks.critics.trunk.load_state_dict(state)
    self.networks.target_critics.trunk.load_state_dict(state)

  def state_dict(self) -> dict[str, Any]:
    """Networks, optimisers, noise and the count of updates."""
    return {
      "networks": {
        name: serialisation.module_state(module)
        for name, module in self.networks.modules().items()
      },
      "log_temperature": self.networks.log_temperature.detach()
      .cpu()
      .numpy()
      .copy(),
      "optimisers": {
        name: serialisation.optimiser_state(optimiser)
        for name, optimiser in self._optimisers.items()
      },
      "generator": serialisation.torch_generator_state(self._generator),
      "updates": self.updates,
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned.

    Raises:
      ValueError: a network's names or shapes differ.
    """
    for name, module in self.networks.modules().items():
      serialisation.load_module_state(module, state["networks"][name], name)
    with torch.no_grad():
      self.networks.log_temperature.copy_(
        torch.from_numpy(np.array(state["log_temperature"]))
      )
    for name, optimiser in self._optimisers.items():
      serialisation.load_optimiser_state(optimiser, state["optimisers"][name])
    serialisation.load_torch_generator_state(
      self._generator, state["generator"]
    )
    self.updates = int(state["updates"])
