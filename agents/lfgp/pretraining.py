"""Behaviour cloning before the first step."""

from dataclasses import dataclass

import numpy as np
import torch

from lfgp_dmc import progress_bars
from lfgp_dmc.agents.cloning import IntentionCloner
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.fields import OptimiserConfig
from lfgp_dmc.agents.lfgp.config import PretrainingConfig
from lfgp_dmc.agents.networks.intentions import IntentionNetwork

_LOG_EVERY = 1000  # updates between readings of the loss


@dataclass
class Pretraining:
  """Trains the intentions on their experts' pairs alone."""

  config: PretrainingConfig
  optimiser: OptimiserConfig
  batch_size: int  # pairs a task
  dtype: torch.dtype

  def __call__(
    self,
    intentions: IntentionNetwork,
    experts: ExpertPool | None,
    generator: np.random.Generator,
    progress_bar: bool = False,
  ) -> None:
    """Makes all updates, if there are any; the trunk is the intentions' own."""
    config = self.config
    if not config.updates:
      return
    assert experts is not None, "pretraining needs demonstrations"
    cloner = IntentionCloner(
      intentions, config.learning_rate, self.optimiser, config.loss, self.dtype
    )
    updates = progress_bars.bar(
      range(1, config.updates + 1),
      desc="pretraining",
      unit="update",
      show=progress_bar,
    )
    for update in updates:
      cloner.anneal((update - 1) / config.updates)
      metrics = cloner.update(experts.sample(generator, self.batch_size))
      if update % _LOG_EVERY == 0:
        loss = float(metrics["loss/behaviour_cloning"])
        updates.set_postfix(loss=f"{loss:.4f}")
    if config.std:  # the squared error does not determine it
      intentions.heads.set_std(config.std)
      intentions.flat.refresh()
