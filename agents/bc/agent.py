"""Behaviour cloning as the supervised loop sees it, and its builder."""

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch

from lfgp_dmc import seeding
from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.bc.config import BcConfig
from lfgp_dmc.agents.bc.pairs import SplitPairs
from lfgp_dmc.agents.bc.pixel_pairs import PixelPairs
from lfgp_dmc.agents.cloning import IntentionCloner, cloning_loss
from lfgp_dmc.agents.demonstration_pool import make_standardiser
from lfgp_dmc.agents.metering import Meter
from lfgp_dmc.agents.network_policy import NetworkPolicy
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.intentions import IntentionNetwork, to_std
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.data import files
from lfgp_dmc.types import Metrics

_LOSS = "behaviour_cloning"


class BcAgent:
  """Imitates by epochs, and keeps the weights that validated best.

  The paper's training: each task's pairs are split 70/30; after each epoch the
  validation loss, the mean over tasks, is measured; `overfit_tolerance` epochs
  without improvement end it.
  """

  def __init__(
    self,
    config: BcConfig,
    tasks: Sequence[str],
    network: IntentionNetwork,
    pairs: SplitPairs,
    shuffling: np.random.Generator,
    dtype: torch.dtype,
  ):
    self.tasks = tuple(tasks)
    self._config = config
    self._network = network
    self._pairs = pairs
    self._shuffling = shuffling
    self._best = copy.deepcopy(network).requires_grad_(False)
    self.policy = NetworkPolicy(self._best, tasks)  # of the best weights so far
    self._cloner = IntentionCloner(
      network, config.learning_rate, config.optimiser, config.loss, dtype
    )
    device = network.standardiser.mean.device
    self._meter = Meter(tasks, (f"loss/{_LOSS}",), (_LOSS,), device)
    self._epoch = self._best_epoch = 0
    self._best_loss = math.inf
    self._validation = [math.nan] * len(self.tasks)
    self._order: list[torch.Tensor] = []  # batches left in this epoch

  @property
  def has_converged(self) -> bool:
    """Whether validation has not improved for `overfit_tolerance` epochs."""
    return self._epoch - self._best_epoch >= self._config.overfit_tolerance

  def begin_epoch(self) -> int:
    """Shuffles the training pairs; returns the updates of the epoch."""
    order = self._pairs.shuffled(self._shuffling, self._config.batch_size)
    self._order = list(order.unbind()[::-1])
    return len(self._order)

  def update(self) -> None:
    """Makes one update, on the epoch's next batch."""
    batch = self._pairs.batch(self._order.pop(), self._shuffling)
    self._meter.add(self._cloner.update(batch))

  def end_epoch(self) -> None:
    """Validates, and keeps the weights if they are the best so far."""
    self._epoch += 1
    self._validation = self.validation_losses()
    loss = float(np.mean(self._validation))
    if loss < self._best_loss:
      self._best_loss, self._best_epoch = loss, self._epoch
      self._best.load_state_dict(self._network.state_dict())

  def validation_losses(self) -> list[float]:
    """Each task's mean loss over all of its validation pairs."""
    network, losses = self._network, []
    with torch.inference_mode():
      for index in range(len(self.tasks)):
        inputs, action = self._pairs.validation(index)
        mean, raw = network.heads.one(network.trunk(inputs[0]), index)
        std = to_std(raw)
        loss, _ = cloning_loss(self._config.loss, mean[None], std[None], action)
        losses.append(loss.item())
    return losses

  def metrics(self) -> Metrics:
    """Training's means since the last call, and the last validation."""
    means = self._meter.read()
    row = {
      "epoch": float(self._epoch),
      "best_epoch": float(self._best_epoch),
      "loss/train": means[f"loss/{_LOSS}"],
      "loss/validation": float(np.mean(self._validation)),
      "loss/best_validation": self._best_loss,
    }
    for task, loss in zip(self.tasks, self._validation, strict=True):
      row[f"loss_train/{task}"] = means[f"{_LOSS}/{task}"]
      row[f"loss_validation/{task}"] = loss
    return row

  def save_policy(
    self, folder: files.Path, config: Mapping[str, Any], env_step: int
  ) -> None:
    """Makes a folder the policy folder of the best weights so far."""
    self.policy.save(folder, config, env_step)

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values; taken between epochs."""
    return {
      "network": serialisation.module_state(self._network),
      "best": serialisation.module_state(self._best),
      "cloner": self._cloner.state_dict(),
      "meter": self._meter.state_dict(),
      "shuffling": self._shuffling.bit_generator.state,
      "epoch": self._epoch,
      "best_epoch": self._best_epoch,
      "best_loss": np.asarray(self._best_loss),
      "validation": np.asarray(self._validation),
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    serialisation.load_module_state(self._network, state["network"], "network")
    self._network.flat.refresh()
    serialisation.load_module_state(self._best, state["best"], "best network")
    self._cloner.load_state_dict(state["cloner"])
    self._meter.load_state_dict(state["meter"])
    self._shuffling.bit_generator.state = state["shuffling"]
    self._epoch = int(state["epoch"])
    self._best_epoch = int(state["best_epoch"])
    self._best_loss = float(state["best_loss"])
    self._validation = [float(loss) for loss in state["validation"]]
    self._order = []


def build(config: BcConfig, parts: AgentParts) -> BcAgent:
  """Builds a BC agent, which sees frames if there are any.

  Raises:
    ValueError: demonstrations are missing, too few, or of other sizes.
  """
  device, seed, tasks = torch.device(parts.device), parts.seed, parts.tasks
  initial = torch.Generator().manual_seed(seeding.derive(seed, "networks"))
  encoder, seen = None, config.encoder
  if parts.frame_shape:
    sizes = seen.features, seen.channels
    encoder = Encoder(parts.frame_shape, *sizes, initial).to(device)
  standardiser = make_standardiser(
    config.inputs,
    parts.demonstrations,
    tasks,
    parts.observation_size,
    parts.action_size,
    seen.features if parts.frame_shape else 0,
  ).to(device)
  network = layouts.make_intentions(
    config.networks.layout,
    standardiser,
    len(tasks),
    config.networks.hidden_size,
    parts.action_size,
    initial,
    encoder=encoder,
  ).to(device)
  dtype = torch.bfloat16 if parts.bfloat16 else torch.float32
  network.flatten(dtype)
  split, share = seeding.generator(seed, "split"), config.validation_share
  which = parts.demonstrations, tasks, standardiser, share, split
  if encoder is None:
    pairs = SplitPairs(*which)
  else:
    pairs = PixelPairs(*which, encoder, seen.shift, dtype)
  shuffling = seeding.generator(seed, "shuffling")
  return BcAgent(config, tasks, network, pairs, shuffling, dtype)
