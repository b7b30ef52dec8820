"""One update of all networks, Algorithm 1 of the paper; torch alone."""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import nn

from agents import serialisation
from agents.experts import Batch, ExpertBatch
from agents.lfgp.batches import Draw
from agents.lfgp.cloning_terms import CloningTerms
from agents.lfgp.config import LfgpConfig
from agents.lfgp.discriminating import Discriminating
from agents.lfgp.networks import LfgpNetworks
from agents.lfgp.recording import RecordedUpdates, Recorder
from agents.losses.critic import (
  critic_loss,
  soft_bellman_target,
  value_penalty_loss,
)
from agents.losses.intention import intention_loss
from agents.losses.temperature import temperature_loss
from agents.networks import tanh_gaussian
from agents.optimisation import (
  clipped_step,
  frozen,
  make_optimiser,
  polyak,
  product_dtype,
)
from agents.rewards import bounded, reward_from_examples
from agents.value_bounds import ValueBounds

Metrics = dict[str, torch.Tensor]

_SATURATED = 0.99


class Phase(NamedTuple):
  """What an update consists of."""

  freezes_trunk: bool
  trains_intentions: bool
  trains_discriminator: bool


class LfgpLearner:
  """Networks, optimisers and updates; batches are the caller's."""

  def __init__(
    self,
    config: LfgpConfig,
    networks: LfgpNetworks,
    generator: torch.Generator,
    recorder: Recorder | None = None,
  ):
    """Makes the optimisers.

    Args:
      config: settings.
      networks: what to train.
      generator: on the networks' device, source of all noise.
      recorder: records updates, which are then replayed; None: each update is
        computed step by step.
    """
    self.networks = networks
    self.updates = 0
    self._config = config
    self._generator = generator
    self._device = networks.log_temperature.device
    self._dtype = product_dtype(config.bfloat16)
    self._critic_parameters = list(networks.critics.parameters())
    self._policy_parameters = networks.intentions.trained_parameters()
    decay = config.weight_decay
    self._optimisers = {
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
    self._discriminating = None
    if networks.discriminator is not None:
      self._discriminating = Discriminating(config, networks, generator)
      self._optimisers |= self._discriminating.optimisers
    self._cloning_terms = CloningTerms(config, networks)
    self._recorded = RecordedUpdates(recorder) if recorder else None
    self._bounds = ValueBounds(
      len(networks.log_temperature),
      config.value_penalty_window,
      config.discount,
      self._device,
    )

  def update(
    self,
    batch: Batch,
    discriminator_batch: Batch | None = None,
    expert: ExpertBatch | None = None,
  ) -> Metrics:
    """One update: discriminator, critics, intentions, temperatures, targets.

    Args:
      batch: B transitions for critics and intentions; their rewards come from
        the discriminator just updated, unless the config says otherwise.
      discriminator_batch: other transitions, for the discriminator; None:
        leave it as it is.
      expert: each task's own pairs, for the discriminator and the BC term;
        may be None if neither is wanted.

    Returns:
      Detached tensors by the names above.
    """
    if discriminator_batch is not None and expert is None:
      raise ValueError("the discriminator's update needs expert pairs")
    draw = Draw(batch, discriminator_batch, expert)
    phase = Phase(
      self.updates < self._config.freeze_updates,
      self.updates >= self._config.intention_delay,
      discriminator_batch is not None,
    )
    self._cloning_terms.fade(self.updates)
    update = functools.partial(self._update, phase)
    if self._recorded is None:
      metrics = update(draw)
    else:
      metrics = self._recorded(update, draw, phase)
    self.updates += 1
    return metrics

  def _update(self, phase: Phase, draw: Draw) -> Metrics:
    """One update; it may be recorded, so only tensors change between two."""
    metrics: Metrics = {}
    batch, discriminator_batch, expert = draw
    if discriminator_batch is not None and expert is not None:
      metrics |= self.update_discriminator(discriminator_batch, expert)
    inputs = batch.inputs
    if batch.owner is not None:  # intentions learn from the replay's rows
      inputs = inputs[: len(inputs) - batch.examples]
      batch = self._with_fresh_actions(batch)
    trunk = self.networks.intentions.trunk
    with frozen(list(trunk.parameters()) if phase.freezes_trunk else []):
      metrics |= self.update_critics(batch, self._rewards_of(batch))
      if phase.trains_intentions:
        log_prob, more = self.update_intentions(inputs, expert)
        metrics |= more | self._update_temperatures(log_prob)
    polyak(
      self.networks.target_critics, self.networks.critics, self._config.polyak
    )
    return metrics

  def update_discriminator(self, batch: Batch, expert: ExpertBatch) -> Metrics:
    """One update of the discriminator, penalty included.

    Args:
      batch: transitions of the replay.
      expert: each task's own pairs, [K, N, ...].

    Returns:
      The metrics of both losses.
    """
    assert self._discriminating is not None, "no discriminator"
    return self._discriminating.update(batch, expert)

  def rewards(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Every task's reward by the current discriminator.

    Args:
      inputs: [B, O], standardised.
      action: [B, A].

    Returns:
      [K, B], without gradient.
    """
    assert self._discriminating is not None, "no discriminator"
    return self._discriminating.rewards(inputs, action)

  def _rewards_of(self, batch: Batch) -> torch.Tensor:
    """Every task's reward of a batch's rows, [K, B]."""
    config = self._config
    if batch.owner is not None:
      tasks = len(self.networks.log_temperature)
      return config.reward_scale * reward_from_examples(batch.owner, tasks)
    if batch.reward is not None:
      return bounded(batch.reward, config.reward_clip, config.reward_scale)
    return self.rewards(batch.inputs, batch.action)

  def _with_fresh_actions(self, batch: Batch) -> Batch:
    """Gives each example of success an action of its task's intention."""
    assert batch.owner is not None
    first = len(batch.action) - batch.examples
    with torch.no_grad():
      inputs = batch.inputs[first:].to(self._dtype)
      action, _ = self._sample(*self.networks.intentions(inputs))
    rows = torch.arange(batch.examples, device=self._device)
    own = action[batch.owner[first:], rows]
    return batch._replace(action=torch.cat([batch.action[:first], own]))

  def update_critics(self, batch: Batch, reward: torch.Tensor) -> Metrics:
    """One update of trunk and critics; reward [K, B]."""
    networks, config = self.networks, self._config
    with torch.no_grad():
      next_inputs = batch.next_inputs.to(self._dtype)
      mean, deviation = networks.intentions(next_inputs)
      action, log_prob = self._sample(mean, deviation)
      next_q = networks.target_critics(next_inputs, action)
      target = soft_bellman_target(
        reward,
        next_q,
        log_prob,
        networks.log_temperature.exp(),
        config.discount,
      )
    q = networks.critics(batch.inputs.to(self._dtype), batch.action)
    mask = None
    if batch.owner is not None:  # an example serves its own task alone
      tasks = torch.arange(len(reward), device=self._device)[:, None]
      mask = ((batch.owner < 0) | (batch.owner == tasks)).float()
    loss, metrics = critic_loss(q, target, mask)
    if config.value_penalty > 0:
      low, high = self._value_bounds(batch, reward, q[0].detach())
      penalty, more = value_penalty_loss(
        q, low, high, config.value_penalty, mask
      )
      loss = loss + penalty
      metrics |= more
    norm = self._step("critic", loss, self._critic_parameters)
    return metrics | {
      "gradient_norm/critic": norm,
      "reward": reward.mean(1),
      "q_bound": reward.abs().amax(1) / (1 - config.discount + 1e-8),
    }

  def _value_bounds(
    self, batch: Batch, reward: torch.Tensor, q: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """The least and greatest possible values, [K, 1] and [K, 1] or [K, B]."""
    if batch.owner is None:
      return self._bounds.of_rewards(reward)
    tasks = torch.arange(len(reward), device=self._device)[:, None]
    scale = self._config.reward_scale
    return self._bounds.of_examples(q, batch.owner == tasks, scale)

  def update_intentions(
    self, inputs: torch.Tensor, expert: ExpertBatch | None
  ) -> tuple[torch.Tensor, Metrics]:
    """Returns the new actions' log densities [K, B], and metrics."""
    networks = self.networks
    inputs = inputs.to(self._dtype)
    with frozen(self._critic_parameters):
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
    terms, more = self._cloning_terms(expert, inputs, mean, deviation, q)
    loss, metrics = loss + terms, metrics | more
    norm = self._step("policy", loss, self._policy_parameters)
    saturated = (action.detach().abs() > _SATURATED).float()
    return log_prob.detach(), metrics | {
      "gradient_norm/policy": norm,
      "saturation": saturated.mean((1, 2)),
    }

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

  def adopt_intention_trunk(self) -> None:
    """Copies the intentions' trunk into critics and targets, if it is to be.

    Not if `actor_trunk` is "own": then the critics start from their own.
    """
    if self._config.actor_trunk == "own":
      return
    state = self.networks.intentions.trunk.state_dict()
    self.networks.critics.trunk.load_state_dict(state)
    self.networks.target_critics.trunk.load_state_dict(state)

  def adopt_prior(self) -> None:
    """Makes the present intentions those to stay near, if it is asked."""
    if self.networks.prior is not None:
      state = self.networks.intentions.state_dict()
      self.networks.prior.load_state_dict(state)

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
      "bounds": self._bounds.state_dict(),
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
    self._bounds.load_state_dict(state["bounds"])
    self.updates = int(state["updates"])
