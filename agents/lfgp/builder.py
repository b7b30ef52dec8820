"""Builds the agent: its config is taken apart here, a group for each part."""

from collections.abc import Mapping, Sequence

import torch

from lfgp_dmc import seeding
from lfgp_dmc.agents.demonstration_pool import (
  ExpertPool,
  check_sizes,
  pooled_observations,
)
from lfgp_dmc.agents.lfgp.agent import LfgpAgent
from lfgp_dmc.agents.lfgp.batch_maker import BatchMaker
from lfgp_dmc.agents.lfgp.config import (
  DiscriminatorReward,
  ExampleReward,
  LfgpConfig,
)
from lfgp_dmc.agents.lfgp.critic_learner import CriticLearner
from lfgp_dmc.agents.lfgp.cuda_graphs import CudaRecorder, Recorder
from lfgp_dmc.agents.lfgp.discriminator_reward import DiscriminatorRewards
from lfgp_dmc.agents.lfgp.example_reward import ExampleRewards
from lfgp_dmc.agents.lfgp.intention_learner import IntentionLearner
from lfgp_dmc.agents.lfgp.learner import LfgpLearner
from lfgp_dmc.agents.lfgp.networks import LfgpNetworks, make_networks
from lfgp_dmc.agents.lfgp.pretraining import Pretraining
from lfgp_dmc.agents.lfgp.prior import Prior
from lfgp_dmc.agents.lfgp.reward_source import RewardSource
from lfgp_dmc.agents.lfgp.stored_reward import StoredRewards, reward_columns
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.agents.schedulers import make_scheduler
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.replay import Replay


def build(
  config: LfgpConfig,
  tasks: Sequence[str],
  demonstrations: Mapping[str, Demonstrations],
  replay: Replay,
  seed: int,
  device: torch.device | str,
  observation_size: int,
  action_size: int,
  *,
  bfloat16: bool = False,
  cuda_graphs: bool = True,
) -> LfgpAgent:
  """Builds an LfGP agent.

  Args:
    config: settings.
    tasks: names of the K tasks, the main task first.
    demonstrations: by task; may be empty if the config uses none.
    replay: transitions, filled by the training loop.
    seed: every random number of the agent follows from it.
    device: where to compute.
    observation_size: O.
    action_size: A.
    bfloat16: products in bfloat16; parameters stay float32.
    cuda_graphs: on a GPU, updates are recorded, then replayed.

  Returns:
    The agent; same seed and calls, same numbers.

  Raises:
    ValueError: demonstrations are missing or of other sizes, the replay lacks
      rewards that are needed, or the scheduler does not fit the tasks.
  """
  device = torch.device(device)
  dtype = torch.bfloat16 if bfloat16 else torch.float32
  standardiser = Standardiser(
    observation_size, config.inputs.tanh_feature_scale
  )
  if config.uses_demonstrations:
    observation = pooled_observations(demonstrations, tasks)
    check_sizes(demonstrations, tasks, observation_size, action_size)
    if config.inputs.standardise:
      standardiser.fit(observation)
  standardiser.to(device)
  experts = None
  if config.uses_demonstrations:
    experts = ExpertPool(demonstrations, tasks, standardiser)
  initial = torch.Generator().manual_seed(seeding.derive(seed, "networks"))
  networks = make_networks(
    config, len(tasks), action_size, standardiser, initial, device
  )
  noise = torch.Generator(device).manual_seed(seeding.derive(seed, "noise"))
  recorder = None
  if device.type == "cuda" and cuda_graphs:
    recorder = CudaRecorder(noise)
  columns = reward_columns(replay, tasks) if config.keeps_rewards else []
  learner = make_learner(config, networks, noise, dtype, recorder, columns)
  batches = BatchMaker(
    config.reward,
    config.batch_size,
    replay,
    columns,
    experts,
    standardiser,
    seeding.generator(seed, "sampling"),
  )
  return LfgpAgent(
    tasks,
    learner,
    batches,
    make_scheduler(
      config.scheduler, tasks, seeding.generator(seed, "scheduler")
    ),
    Pretraining(config.pretraining, config.optimiser, config.batch_size, dtype),
    experts,
    seed,
    xi=config.scheduler.xi,
    discount=config.critic.discount,
  )


def make_learner(
  config: LfgpConfig,
  networks: LfgpNetworks,
  generator: torch.Generator,
  dtype: torch.dtype = torch.float32,
  recorder: Recorder | None = None,
  stored_columns: Sequence[int] = (),
) -> LfgpLearner:
  """Builds what trains the networks.

  Args:
    config: settings.
    networks: what to train.
    generator: on the networks' device, source of all noise.
    dtype: of products.
    recorder: see `LfgpLearner`.
    stored_columns: the tasks' places among stored rewards, if those are used.
  """
  prior = None
  if networks.prior is not None:
    prior = Prior(config.prior, networks.prior, generator.device)
  reward = _make_reward(config, networks, generator, dtype, stored_columns)
  critics = CriticLearner(
    config.critic, config.optimiser, networks, generator, dtype, reward.bounds
  )
  intentions = IntentionLearner(
    config.intention, config.optimiser, networks, prior, generator, dtype
  )
  return LfgpLearner(
    networks,
    reward,
    critics,
    intentions,
    prior,
    generator,
    config.critic.warmup_updates,
    recorder,
  )


def _make_reward(
  config: LfgpConfig,
  networks: LfgpNetworks,
  generator: torch.Generator,
  dtype: torch.dtype,
  stored_columns: Sequence[int],
) -> RewardSource:
  match config.reward:
    case DiscriminatorReward() as own:
      decay = config.optimiser.weight_decay
      return DiscriminatorRewards(own, decay, networks, generator, dtype)
    case ExampleReward() as own:
      intentions = networks.intentions
      tasks = len(networks.log_temperature)
      return ExampleRewards(
        own, config.batch_size, intentions, tasks, generator, dtype
      )
  return StoredRewards(config.reward, stored_columns[0])
