"""The discriminators' part of an update, and the reward they give."""

import torch

from agents.experts import Batch, ExpertBatch
from agents.lfgp.config import LfgpConfig
from agents.losses.discriminator import (
  discriminator_loss,
  gradient_penalty_loss,
  mix,
)
from agents.networks.discriminator import Discriminator
from agents.optimisation import make_optimiser, product_dtype
from agents.rewards import reward_from_logits

Metrics = dict[str, torch.Tensor]


class DiscriminatorLearner:
  """Trains the discriminator network; its state is the caller's to store."""

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
    """One update, penalty included; see `LfgpLearner.update_discriminator`."""
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
    """Every task's reward [K, B] of inputs [B, O] and actions [B, A]."""
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
