"""The discriminators' part of an update, and the reward they give."""

import torch

from lfgp_dmc.agents.demonstration_pool import Batch, ExpertBatch
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.networks import LfgpNetworks
from lfgp_dmc.agents.losses.discriminator import (
  discriminator_loss,
  gradient_penalty_loss,
  mix,
)
from lfgp_dmc.agents.networks.discriminator import Discriminator
from lfgp_dmc.agents.optimisation import make_optimiser, product_dtype
from lfgp_dmc.agents.rewards import reward_from_logits

Metrics = dict[str, torch.Tensor]


class DiscriminatorLearner:
  """The discriminators of all tasks: one network, or the main task's apart."""

  def __init__(
    self,
    config: LfgpConfig,
    networks: LfgpNetworks,
    generator: torch.Generator,
  ):
    """Makes the optimisers, by the names of the networks.

    Raises:
      ValueError: there is no discriminator.
    """
    if networks.discriminator is None:
      raise ValueError("there is no discriminator")
    made = {"discriminator": networks.discriminator}
    if networks.main_discriminator is not None:
      made = {"main_discriminator": networks.main_discriminator} | made
    parts = {
      name: _NetworkLearner(config, network, generator)
      for name, network in made.items()
    }
    self.optimisers = {name: part.optimiser for name, part in parts.items()}
    self._parts = list(parts.values())
    # How many of the K tasks each has, the main task's first.
    self._sizes = [network.output.out_features for network in made.values()]

  def update(self, batch: Batch, expert: ExpertBatch) -> Metrics:
    """One update of each network.

    Args:
      batch: transitions of the replay.
      expert: each task's own pairs, [K, N, ...].

    Returns:
      The metrics of both losses.
    """
    groups = zip(
      expert.inputs.split(self._sizes),
      expert.action.split(self._sizes),
      strict=True,
    )
    metrics = [
      part.update(batch, ExpertBatch(*group))
      for part, group in zip(self._parts, groups, strict=True)
    ]
    return metrics[0] if len(metrics) == 1 else self._joined(metrics)

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
    self,
    config: LfgpConfig,
    network: Discriminator,
    generator: torch.Generator,
  ):
    """Makes the optimiser.

    Args:
      config: settings.
      network: what to train.
      generator: on the network's device, source of all noise.
    """
    self.optimiser = make_optimiser(
      list(network.parameters()),
      config.discriminator_learning_rate,
      config.weight_decay,
    )
    self._config = config
    self._network = network
    self._generator = generator
    self._device = network.output.weight.device
    self._dtype = product_dtype(config.bfloat16)

  def update(self, batch: Batch, expert: ExpertBatch) -> Metrics:
    """One update, penalty included, on the expert pairs of its own tasks."""
    config, network = self._config, self._network
    tasks, rows = expert.action.shape[:2]
    policy_pairs = network.join(self._disturb(batch.inputs), batch.action)
    expert_pairs = network.join(self._disturb(expert.inputs), expert.action)
    width = expert_pairs.shape[2]
    if config.gradient_penalty_mixing == "row":
      width = 1
    share = torch.rand(
      (tasks, rows, width), generator=self._generator, device=self._device
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
    self.optimiser.zero_grad()
    (loss + penalty).backward()
    self.optimiser.step()
    return metrics | more

  def rewards(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """The reward of its tasks of inputs [B, O] and actions [B, A]."""
    config, network = self._config, self._network
    logits = network.logits(network.join(inputs, action).to(self._dtype))
    return reward_from_logits(
      logits.t(), config.reward, config.reward_clip, config.reward_scale
    )

  def _disturb(self, inputs: torch.Tensor) -> torch.Tensor:
    """Adds training noise, if any."""
    if not self._config.discriminator_noise:
      return inputs
    noise = torch.randn(
      inputs.shape, generator=self._generator, device=self._device
    )
    return inputs + self._config.discriminator_noise * noise
