"""One update of all networks, Algorithm 1 of the paper."""

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.batches import Draw
from lfgp_dmc.agents.lfgp.critic_learner import CriticLearner
from lfgp_dmc.agents.lfgp.cuda_graphs import CudaRecorder, RecordedUpdates
from lfgp_dmc.agents.lfgp.intention_learner import IntentionLearner
from lfgp_dmc.agents.lfgp.networks import LfgpNetworks
from lfgp_dmc.agents.lfgp.prior import Prior
from lfgp_dmc.agents.lfgp.reward_source import RewardSource
from lfgp_dmc.agents.lfgp.second_thread import SecondThread, at_once
from lfgp_dmc.agents.losses import Metrics


class LfgpLearner:
  """Networks, optimisers and updates; batches are the caller's."""

  def __init__(
    self,
    networks: LfgpNetworks,
    reward: RewardSource,
    critics: CriticLearner,
    intentions: IntentionLearner,
    prior: Prior | None,
    generator: torch.Generator,
    warmup_updates: int = 0,
    recorder: CudaRecorder | None = None,
    second: SecondThread | None = None,
  ):
    """With a recorder, updates are recorded, then replayed.

    With a second thread, discriminators learn beside the rest of an update.
    """
    self.networks = networks
    self.reward = reward
    self.critics = critics
    self.intentions = intentions
    self.prior = prior
    self.updates = 0
    self._generator = generator
    self._warmup_updates = warmup_updates
    self._recorded = RecordedUpdates(recorder) if recorder else None
    self._second = second
    self._optimisers = {
      "critic": critics.optimiser,
      **intentions.optimisers,
      **reward.optimisers,
    }

  def update(self, draw: Draw) -> Metrics:
    """One update: discriminators, critics, intentions, temperatures, targets.

    Its metrics have the names in `metric_names.py`; with a recorder, the next
    update overwrites them.
    """
    trains_intentions = self.updates >= self._warmup_updates
    if self.prior is not None:
      self.prior.fade(self.updates)
    self.critics.reveal(self.updates)
    if self._recorded is None:
      metrics = self._update(trains_intentions, draw)
    else:
      update = functools.partial(self._update, trains_intentions)
      metrics = self._recorded(update, draw, trains_intentions)
    self.updates += 1
    return metrics

  def _update(self, trains_intentions: bool, draw: Draw) -> Metrics:
    """One update; it may be recorded, so only tensors change between two."""
    if self._second is not None:
      # Rewards are by the discriminators before their step, not after.
      self._second.seed_noise(self._generator)
      start = self._second.start
      following = start(self.critics.following, draw.batch.next_inputs)
      batch = self.reward.label(draw.batch)
      trained = start(self.reward.update, draw)
    else:
      start = at_once
      trained = start(self.reward.update, draw)
      batch = self.reward.label(draw.batch)
      following = start(self.critics.following, batch.next_inputs)
    metrics = self.critics.update(batch, following)
    followed = start(self.critics.update_targets)
    if trains_intentions:
      states = batch.inputs[: batch.policy_rows]
      if draw.replayed is not None:
        states = draw.replayed.inputs
      metrics |= self.intentions.update(states)
    followed()
    return metrics | trained()

  def state_dict(self) -> dict[str, Any]:
    """Networks, optimisers, noise and the count of updates."""
    temperature = self.networks.log_temperature.detach()
    return {
      "networks": {
        name: serialisation.module_state(module)
        for name, module in self.networks.modules().items()
      },
      "log_temperature": temperature.cpu().numpy().copy(),
      "optimisers": {
        name: optimiser.state_dict()
        for name, optimiser in self._optimisers.items()
      },
      "generator": self._generator.get_state().numpy(),
      "bounds": self.critics.bounds.state_dict(),
      "updates": self.updates,
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned.

    Raises:
      ValueError: a network's names or shapes differ.
    """
    for name, module in self.networks.modules().items():
      serialisation.load_module_state(module, state["networks"][name], name)
    self.networks.refresh()
    with torch.no_grad():
      self.networks.log_temperature.copy_(
        torch.from_numpy(np.array(state["log_temperature"]))
      )
    for name, optimiser in self._optimisers.items():
      optimiser.load_state_dict(state["optimisers"][name])
    self._generator.set_state(torch.from_numpy(np.array(state["generator"])))
    self.critics.bounds.load_state_dict(state["bounds"])
    self.updates = int(state["updates"])
