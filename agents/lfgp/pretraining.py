"""Behaviour cloning before the first step."""

import numpy as np
import torch
import tqdm

from lfgp_dmc.agents.cloning import IntentionCloner
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.fields import OptimiserConfig
from lfgp_dmc.agents.lfgp.config import PretrainingConfig
from lfgp_dmc.agents.networks.intentions import IntentionNetwork

_LOG_EVERY = 1000  # updates between readings of the loss


class Pretraining:
  """Trains the intentions on their experts' pairs alone."""

  def __init__(
    self,
    config: PretrainingConfig,
    optimiser: OptimiserConfig,
    batch_size: int,
    dtype: torch.dtype,
  ):
    """Keeps the settings; `batch_size` counts pairs a task."""
    self._config = config
    self._optimiser = optimiser
    self._batch_size = batch_size
    self._dtype = dtype

  def __call__(
    self,
    intentions: IntentionNetwork,
    experts: ExpertPool | None,
    generator: np.random.Generator,
    progress_bar: bool = False,
  ) -> None:
    """Makes all updates, if there are any to make.

    Args:
      intentions: what to train, with a trunk of their own.
      experts: all tasks' demonstrations; None only without updates.
      generator: source of the batches.
      progress_bar: whether to show the updates' rate and time left.
    """
    config = self._config
    if not config.updates:
      return
    assert experts is not None, "pretraining needs demonstrations"
    cloner = IntentionCloner(
      intentions,
      config.learning_rate,
      self._optimiser,
      config.loss,
      self._dtype,
    )
    cloner.anneal(config.updates)
    updates = tqdm.trange(
      1,
      config.updates + 1,
      desc="pretraining",
      unit="update",
      disable=not progress_bar,
    )
    for update in updates:
      metrics = cloner.update(experts.sample(generator, self._batch_size))
      if update % _LOG_EVERY == 0:
        loss = float(metrics["loss/behaviour_cloning"])
        updates.set_postfix(loss=f"{loss:.4f}")
    if config.std:  # the squared error does not determine it
      intentions.heads.set_std(config.std)
