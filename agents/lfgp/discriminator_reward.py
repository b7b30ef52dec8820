"""Discriminators of expert and policy, and the reward they give."""

import numpy as np
import torch

from lfgp_dmc.agents.batches import Batch, Draw, ExpertBatch
from lfgp_dmc.agents.lfgp.config import DiscriminatorReward
from lfgp_dmc.agents.lfgp.networks import Training
from lfgp_dmc.agents.lfgp.reward_source import LabelledBatch, RewardSource
from lfgp_dmc.agents.losses import Metrics
from lfgp_dmc.agents.losses.discriminator import (
  discriminator_loss,
  gradient_penalty_loss,
  mix,
)
from lfgp_dmc.agents.networks.discriminator import Discriminator
from lfgp_dmc.agents.optimisation import Adam
from lfgp_dmc.agents.rewards import reward_from_logits
from lfgp_dmc.types import Episode


class DiscriminatorRewards(RewardSource):
  """The discriminators of all tasks; the main task may have its own network."""

  def __init__(self, config: DiscriminatorReward, shared: Training):
    """Makes the optimisers, by the names of the networks."""
    parts = {
      name: _NetworkLearner(config, network, shared)
      for name, network in shared.networks.modules().items()
      if isinstance(network, Discriminator)
    }
    self.optimisers = {name: part.optimiser for name, part in parts.items()}
    self._parts = list(parts.values())  # the main task's first
    self._sizes = [part.tasks for part in self._parts]
    self._standardiser = shared.networks.intentions.standardiser

  def update(self, draw: Draw) -> Metrics:
    """One update of each network, if there are rows for it."""
    policy, expert = draw.policy, draw.expert
    if policy is None or expert is None:
      return {}
    groups = zip(
      expert.inputs.split(self._sizes),
      expert.action.split(self._sizes),
      strict=True,
    )
    metrics = [
      part.update(policy, ExpertBatch(*group))
      for part, group in zip(self._parts, groups, strict=True)
    ]
    return metrics[0] if len(metrics) == 1 else self._joined(metrics)

  def label(self, batch: Batch) -> LabelledBatch:
    """Rewards by the discriminators as they are now."""
    reward = self.rewards(batch.inputs, batch.action)
    return LabelledBatch(*batch[:3], reward)

  def main_rewards(self, episode: Episode) -> np.ndarray:
    """By the discriminators as they are now, float32 [T]."""
    device = self._standardiser.mean.device
    observation, action = (
      torch.from_numpy(rows).to(device) for rows in episode[:2]
    )
    inputs = self._standardiser(observation)
    return self.rewards(inputs, action)[0].cpu().numpy()

  def rewards(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Every task's reward [K, B] of inputs [B, O] and actions [B, A]."""
    return torch.cat([part.rewards(inputs, action) for part in self._parts])

  def _joined(self, metrics: list[Metrics]) -> Metrics:
    """One after the other what differs by task; else the mean over tasks."""
    joined = {}
    for name in metrics[0]:
      values = [part[name] for part in metrics]
      if values[0].dim():
        joined[name] = torch.cat(values)
      else:
        sizes = zip(values, self._sizes, strict=True)
        total = torch.stack([value * size for value, size in sizes]).sum()
        joined[name] = total / sum(self._sizes)
    return joined


class _NetworkLearner:
  """Trains one discriminator network."""

  def __init__(
    self, config: DiscriminatorReward, network: Discriminator, shared: Training
  ):
    _, optimiser, self._generator, self._dtype = shared
    self.optimiser = Adam(
      network.flat, config.learning_rate, optimiser.weight_decay
    )
    self._config = config
    self._network = network
    self.tasks = network.output.out_features  # of the K
    self._device = network.output.weight.device

  def update(self, policy: Batch, expert: ExpertBatch) -> Metrics:
    """One update, penalty included, on the expert pairs of its own tasks."""
    config, network = self._config, self._network
    tasks, rows = expert.action.shape[:2]
    policy_pairs = network.join(self._disturb(policy.inputs), policy.action)
    expert_pairs = network.join(self._disturb(expert.inputs), expert.action)
    share = torch.rand(
      expert_pairs.shape, generator=self._generator, device=self._device
    )
    mixed = mix(policy_pairs, expert_pairs, share)
    pairs = torch.cat([policy_pairs, expert_pairs.flatten(0, 1)])
    logits, gradient = network.logits_and_gradient(
      pairs.to(self._dtype),
      mixed.to(self._dtype),
      config.gradient_penalty_per_task,
    )
    policy_rows = policy_pairs.shape[0]
    own = logits[policy_rows:].view(tasks, rows, tasks)
    loss, metrics = discriminator_loss(
      logits[:policy_rows], own.diagonal(dim1=0, dim2=2)
    )
    penalty, more = gradient_penalty_loss(gradient, config.gradient_penalty)
    self.optimiser.step(loss + penalty)
    return metrics | more

  def rewards(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """The reward of its tasks of inputs [B, O] and actions [B, A]."""
    config, network = self._config, self._network
    logits = network.logits(network.join(inputs, action).to(self._dtype))
    return reward_from_logits(
      logits.t(), config.form, config.clip, config.scale
    )

  def _disturb(self, inputs: torch.Tensor) -> torch.Tensor:
    """Adds training noise, if any."""
    if not self._config.noise:
      return inputs
    noise = torch.randn(
      inputs.shape, generator=self._generator, device=self._device
    )
    return inputs + self._config.noise * noise
