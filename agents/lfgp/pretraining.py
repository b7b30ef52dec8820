"""The start from cloned behaviour: pure cloning before the first step."""

from collections.abc import Sequence

import numpy as np
import torch
import tqdm
from absl import logging

from lfgp_dmc.agents.cloning import IntentionCloner
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.prior import entropies
from lfgp_dmc.agents.networks.intentions import IntentionNetwork

_LOG_EVERY = 1000  # updates between readings of the loss
_ENTROPY_ROWS = 1024  # a task


def clone(
  config: LfgpConfig,
  intentions: IntentionNetwork,
  experts: ExpertPool,
  generator: np.random.Generator,
  progress_bar: bool = False,
) -> None:
  """Trains the intentions on their experts' pairs alone.

  Args:
    config: how long, and by which loss.
    intentions: what to train, trunk included, whosever it is later.
    experts: all tasks' demonstrations.
    generator: source of the batches.
    progress_bar: whether to show the updates' rate and time left.
  """
  intentions.owns_trunk = True
  cloner = IntentionCloner(
    intentions,
    config.bc_learning_rate,
    config.weight_decay,
    config.max_gradient_norm,
    config.bfloat16,
    config.bc_loss,
  )
  cloner.anneal(config.bc_warm_start_updates)
  updates = tqdm.trange(
    1,
    config.bc_warm_start_updates + 1,
    desc="warm start",
    unit="update",
    disable=not progress_bar,
  )
  for update in updates:
    metrics = cloner.update(experts.sample(generator, config.batch_size))
    if update % _LOG_EVERY == 0:
      loss = float(metrics["loss/behaviour_cloning"])
      updates.set_postfix(loss=f"{loss:.4f}")
  intentions.owns_trunk = config.owns_trunk
  if config.cloned_deviation:  # the squared error says nothing of it
    intentions.heads.set_deviation(config.cloned_deviation)


def warn_of_precise_prior(
  config: LfgpConfig,
  tasks: Sequence[str],
  intentions: IntentionNetwork,
  experts: ExpertPool,
) -> None:
  """Names the tasks whose prior lacks the entropy that is asked for.

  Their temperatures would grow without bound, since the divergence holds the
  intentions at the prior's entropy.

  Args:
    config: with the target entropy.
    tasks: the K tasks.
    intentions: as they start, which is the prior.
    experts: where each is at home.
  """
  rows = experts.sample(np.random.default_rng(0), _ENTROPY_ROWS).inputs
  noise = torch.Generator(rows.device).manual_seed(0)
  values = entropies(intentions, rows, noise).tolist()
  for task, value in zip(tasks, values, strict=True):
    if value < config.target_entropy:
      logging.warning(
        "the intention of %s starts with an entropy of %.1f nats, where its "
        "prior holds it; target_entropy is %.1f, so that its temperature will "
        "grow without bound: choose a lower one",
        task,
        value,
        config.target_entropy,
      )
