"""Builds the agent: its config is taken apart here, a group for each part."""

import functools
from collections.abc import Sequence

import torch

from lfgp_dmc import seeding
from lfgp_dmc.agents.demonstration_pool import ExpertPool, make_standardiser
from lfgp_dmc.agents.lfgp.agent import LfgpAgent
from lfgp_dmc.agents.lfgp.batch_maker import BatchMaker
from lfgp_dmc.agents.lfgp.config import (
  DiscriminatorReward,
  ExampleReward,
  LfgpConfig,
)
from lfgp_dmc.agents.lfgp.critic_learner import CriticLearner
from lfgp_dmc.agents.lfgp.cuda_graphs import CudaRecorder
from lfgp_dmc.agents.lfgp.discriminator_reward import DiscriminatorRewards
from lfgp_dmc.agents.lfgp.example_reward import ExampleRewards
from lfgp_dmc.agents.lfgp.intention_learner import IntentionLearner
from lfgp_dmc.agents.lfgp.learner import LfgpLearner
from lfgp_dmc.agents.lfgp.networks import LfgpNetworks, Training, make_networks
from lfgp_dmc.agents.lfgp.pretraining import Pretraining
from lfgp_dmc.agents.lfgp.prior import Prior
from lfgp_dmc.agents.lfgp.reward_source import RewardSource
from lfgp_dmc.agents.lfgp.second_thread import SecondThread
from lfgp_dmc.agents.lfgp.stored_reward import StoredRewards
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.agents.schedulers import make_scheduler


def build(config: LfgpConfig, parts: AgentParts) -> LfgpAgent:
  """Builds an LfGP agent.

  Raises:
    ValueError: demonstrations, stored rewards, scheduler or number of examples
      do not fit.
  """
  replay, tasks, seed = parts.replay, parts.tasks, parts.seed
  assert replay is not None, "LfGP acts"
  device = torch.device(parts.device)
  dtype = torch.bfloat16 if parts.bfloat16 else torch.float32
  random = functools.partial(seeding.generator, seed)
  sizes = parts.observation_size, parts.action_size
  used = parts.demonstrations if config.uses_demonstrations else None
  standardiser = make_standardiser(config.inputs, used, tasks, *sizes)
  standardiser = standardiser.to(device)
  experts = None
  if used is not None:
    experts = ExpertPool(used, tasks, standardiser, config.final_rows)
  initial = torch.Generator().manual_seed(seeding.derive(seed, "networks"))
  networks = make_networks(
    config,
    len(tasks),
    parts.action_size,
    standardiser,
    initial,
    device,
    parts.encoder,
  )
  noise = torch.Generator(device).manual_seed(seeding.derive(seed, "noise"))
  columns = replay.reward_columns(tasks) if config.keeps_rewards else []
  learner = _make_learner(
    config, networks, noise, dtype, columns, parts.threads, parts.cuda_graphs
  )
  batches = BatchMaker(
    config, replay, columns, experts, standardiser, random("sampling")
  )
  return LfgpAgent(
    config,
    tasks,
    learner,
    batches,
    make_scheduler(config.scheduler, tasks, random("scheduler")),
    Pretraining(config.pretraining, config.optimiser, config.batch_size, dtype),
    experts,
    seed,
  )


def _make_learner(
  config: LfgpConfig,
  networks: LfgpNetworks,
  generator: torch.Generator,
  dtype: torch.dtype,
  stored_columns: Sequence[int],
  threads: int,
  cuda_graphs: bool,
) -> LfgpLearner:
  """Builds what trains the networks; noise is from `generator`.

  `stored_columns` are the tasks' places among stored rewards, if those are
  used; products are of the dtype.
  """
  networks.flatten(dtype)
  on_gpu = generator.device.type == "cuda"
  second = None
  has_discriminators = isinstance(config.reward, DiscriminatorReward)
  if threads > 1 and has_discriminators and not on_gpu:
    second = SecondThread(threads)
  prior = None
  if networks.prior is not None:
    prior = Prior(config.prior, networks.prior, generator.device)
  shared = Training(networks, config.optimiser, generator, dtype)
  of_reward = shared
  if second is not None:
    of_reward = shared._replace(generator=second.generator)
  reward = _make_reward(config, of_reward, stored_columns)
  return LfgpLearner(
    networks,
    reward,
    CriticLearner(config.critic, shared, reward.bounds),
    IntentionLearner(config.intention, shared, prior),
    prior,
    generator,
    config.critic.warmup_updates,
    CudaRecorder(generator) if on_gpu and cuda_graphs else None,
    second,
  )


def _make_reward(
  config: LfgpConfig, shared: Training, stored_columns: Sequence[int]
) -> RewardSource:
  match config.reward:
    case DiscriminatorReward() as own:
      return DiscriminatorRewards(own, shared)
    case ExampleReward() as own:
      return ExampleRewards(own, config.batch_size, shared)
  return StoredRewards(config.reward, stored_columns[0])
