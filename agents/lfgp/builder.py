"""Builds the agent from its config and what it is to learn from."""

import math
from collections.abc import Mapping, Sequence

import torch

from agents.experts import (
  DemonstrationArrays,
  ExpertPool,
  check_sizes,
  pooled_observations,
)
from agents.lfgp.agent import LfgpAgent
from agents.lfgp.batches import Replay
from agents.lfgp.config import LfgpConfig
from agents.lfgp.learner import LfgpLearner
from agents.lfgp.networks import make_networks
from agents.lfgp.recording import CudaRecorder
from agents.networks.trunk import Standardiser
from agents.schedulers import make_scheduler
from lfgp_dmc import seeding


def build(
  config: LfgpConfig,
  tasks: Sequence[str],
  demonstrations: Mapping[str, DemonstrationArrays],
  replay: Replay,
  seed: int,
  device: torch.device | str,
  observation_size: int,
  action_size: int,
) -> LfgpAgent:
  """Builds an LfGP agent.

  Args:
    config: settings.
    tasks: names of the K tasks, the main task first.
    demonstrations: task -> arrays; may be empty if the config uses none.
    replay: transitions, filled by the training loop.
    seed: every random number of the agent follows from it.
    device: where to compute.
    observation_size: O.
    action_size: A.

  Returns:
    The agent; same seed and calls, same numbers.

  Raises:
    ValueError: demonstrations are missing or of other sizes, the replay lacks
      rewards that are needed, or the scheduler does not fit the tasks.
  """
  device = torch.device(device)
  standardiser = Standardiser(
    observation_size, config.absorbing_flag, config.fine_scale
  )
  experts = None
  if config.uses_demonstrations:
    observation = pooled_observations(demonstrations, tasks)
    check_sizes(demonstrations, tasks, observation_size, action_size)
    if config.standardise:
      standardiser.fit(observation, config.deviation_floor)
  standardiser.to(device)
  if config.uses_demonstrations:
    experts = ExpertPool(
      demonstrations,
      tasks,
      standardiser,
      device,
      config.final_rows,
      config.translation_reach,
      config.main_expert_share,
    )
  initial = torch.Generator().manual_seed(seeding.derive(seed, "networks"))
  networks = make_networks(
    config, len(tasks), action_size, standardiser, initial, device
  )
  noise = torch.Generator(device).manual_seed(seeding.derive(seed, "noise"))
  scheduler = make_scheduler(
    config,
    tasks,
    0,
    math.ceil(config.episode_steps / config.xi),
    seeding.generator(seed, "scheduler"),
  )
  recorder = None
  if device.type == "cuda" and config.cuda_graphs:
    recorder = CudaRecorder(noise)
  learner = LfgpLearner(config, networks, noise, recorder)
  return LfgpAgent(config, tasks, learner, scheduler, experts, replay, seed)
