"""One update of all networks, Algorithm 1 of the paper; torch alone."""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch

from agents import serialisation
from agents.experts import Batch, ExpertBatch
from agents.lfgp.batches import Draw
from agents.lfgp.config import LfgpConfig
from agents.lfgp.critic_learner import CriticLearner
from agents.lfgp.discriminator_learner import DiscriminatorLearner
from agents.lfgp.intention_learner import IntentionLearner
from agents.lfgp.networks import LfgpNetworks
from agents.lfgp.recording import RecordedUpdates, Recorder
from agents.optimisation import frozen, polyak
from agents.rewards import bounded, reward_from_examples

Metrics = dict[str, torch.Tensor]


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
    """Makes the learners of the parts.

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
    self._recorded = RecordedUpdates(recorder) if recorder else None
    self.critics = CriticLearner(config, networks, generator)
    self.intentions = IntentionLearner(config, networks, generator)
    self._optimisers = {
      "critic": self.critics.optimiser,
      **self.intentions.optimisers,
    }
    self.discriminators = None  # None: rewards come from elsewhere
    if networks.discriminator is not None:
      self.discriminators = DiscriminatorLearner(config, networks, generator)
      self._optimisers |= self.discriminators.optimisers

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
      Detached tensors by the names in `metric_names.py`; with a recorder, the
      next update overwrites them.

    Raises:
      ValueError: the discriminator is to be updated without expert pairs.
    """
    if discriminator_batch is not None and expert is None:
      raise ValueError("the discriminator's update needs expert pairs")
    draw = Draw(batch, discriminator_batch, expert)
    phase = Phase(
      self.updates < self._config.freeze_updates,
      self.updates >= self._config.intention_delay,
      discriminator_batch is not None,
    )
    self.intentions.fade(self.updates)
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
      assert self.discriminators is not None, "no discriminator"
      metrics |= self.discriminators.update(discriminator_batch, expert)
    inputs = batch.inputs
    if batch.owner is not None:  # intentions learn from the replay's rows
      inputs = inputs[: len(inputs) - batch.examples]
      batch = self.intentions.with_fresh_actions(batch)
    if not self._config.intentions_on_experts:
      inputs = inputs[: len(inputs) - batch.shown]
    trunk = self.networks.intentions.trunk
    with frozen(list(trunk.parameters()) if phase.freezes_trunk else []):
      metrics |= self.critics.update(batch, self.rewards_of(batch))
      if phase.trains_intentions:
        metrics |= self.intentions.update(inputs, expert)
    polyak(
      self.networks.target_critics, self.networks.critics, self._config.polyak
    )
    return metrics

  def rewards(self, inputs: torch.Tensor, action: torch.Tensor) -> torch.Tensor:
    """Every task's reward by the current discriminator.

    Args:
      inputs: [B, O], standardised.
      action: [B, A].

    Returns:
      [K, B], without gradient.
    """
    assert self.discriminators is not None, "no discriminator"
    return self.discriminators.rewards(inputs, action)

  def rewards_of(self, batch: Batch) -> torch.Tensor:
    """Every task's reward of a batch's rows, [K, B], by `reward_source`."""
    config = self._config
    if batch.owner is not None:
      tasks = len(self.networks.log_temperature)
      return config.reward_scale * reward_from_examples(batch.owner, tasks)
    if batch.reward is not None:
      return bounded(batch.reward, config.reward_clip, config.reward_scale)
    return self.rewards(batch.inputs, batch.action)

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
      "bounds": self.critics.state_dict(),
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
    self.critics.load_state_dict(state["bounds"])
    self.updates = int(state["updates"])
