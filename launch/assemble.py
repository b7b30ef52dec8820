"""The parts of a run, made once from its config."""

import functools
import os
import pathlib
from typing import NamedTuple

import dm_env
import torch

from lfgp_dmc import seeding
from lfgp_dmc.acting import environments, evaluation, wrappers
from lfgp_dmc.agents.networks import encoder as encoders
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import command, datasets, encoding, policies, torch_setup
from lfgp_dmc.launch.configs import ALGORITHMS, RunConfig
from lfgp_dmc.observations import REWARD_PREFIX
from lfgp_dmc.runs import checkpoints
from lfgp_dmc.runs.run import Run
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.runs.schedule import TrainSchedule
from lfgp_dmc.types import ActingAgent, SupervisedAgent


class Parts(NamedTuple):
  """What is read and built before a run's folder is made."""

  environment: dm_env.Environment
  tasks: tuple[str, ...]  # that are learned, the main task first
  widths: tuple[int, int]  # (O, A); of cloning from pixels, without them
  demonstrations: dict[str, Demonstrations]
  device: torch.device
  frame_shape: tuple[int, ...] = ()  # [C, H, W, 3] if it acts from pixels
  encoder: Encoder | None = None  # has made the features of all observations


def make_parts(config: RunConfig, folder: pathlib.Path | None = None) -> Parts:
  """Sets torch up, builds the environment, reads the demonstrations.

  From pixels, acting agents see the features that the encoder of a clone makes
  (of `config.init_from`, or of the run in the folder, if there is one).

  Raises:
    UserError: there is no such device, environment, dataset or encoder.
  """
  device = torch_setup.apply(config)
  with command.checked_input():
    # Without `reseed`, each continuation has starts of its own.
    stored = checkpoints.every(RunFolder(folder).checkpoints) if folder else []
    step = int(stored[-1].name) if stored else 0
    environment = config.environment_spec.build(
      config.agent.keeps_rewards,
      seeding.derive(config.seed, "environment", step),
    )
    tasks = tasks_of(config, environment)
    shape = environments.frame_shape(environment)
    widths = environments.widths(environment)
  found = datasets.load(config, tasks, widths, shape)
  if not shape or ALGORITHMS[config.algorithm].is_supervised:
    return Parts(environment, tasks, widths, found, device, shape)
  clone = encoding.clone_of(config, folder, shape)
  environment = wrappers.with_features(environment, clone.encode)
  found = {
    k: encoding.with_features(k, data, clone) for k, data in found.items()
  }
  widths = environments.widths(environment)
  encoder = encoders.frozen(clone)
  return Parts(environment, tasks, widths, found, device, shape, encoder)


def tasks_of(
  config: RunConfig, environment: dm_env.Environment
) -> tuple[str, ...]:
  """The tasks that are learned, the main task first."""
  if not ALGORITHMS[config.algorithm].is_multitask:
    return (config.main_task,)
  return config.environment_spec.tasks(environment)


def make_replay(
  config: RunConfig, parts: Parts, folder: pathlib.Path | None = None
) -> Replay:
  """An empty replay, or the one that the folder holds."""
  reward_tasks: tuple[str, ...] = ()
  if config.agent.keeps_rewards:  # all that are observed, for transfers
    reward_tasks = environments.with_observed_tasks(
      parts.environment, parts.tasks, REWARD_PREFIX
    )
  # A full ring must still hold the rows of the last checkpoint.
  between = min(config.checkpoint_every, config.env_steps)
  slack = between + 2 * config.most_episode_steps
  return Replay(
    config.replay_capacity if folder else 1,
    *parts.widths,
    folder,
    slack=slack if folder else 0,
    reward_tasks=reward_tasks,
  )


def make_agent(
  config: RunConfig, parts: Parts, replay: Replay | None
) -> ActingAgent | SupervisedAgent:
  """The config's agent; raises ValueError if the parts do not fit it."""
  return ALGORITHMS[config.algorithm].build(
    config.agent,
    AgentParts(
      tasks=parts.tasks,
      demonstrations=parts.demonstrations,
      replay=replay,
      seed=seeding.derive(config.seed, "agent"),
      device=parts.device,
      observation_size=parts.widths[0],
      action_size=parts.widths[1],
      bfloat16=torch_setup.uses_bfloat16(config, parts.device),
      threads=config.threads or command.cores(),
      cuda_graphs=config.cuda_graphs,
      frame_shape=parts.frame_shape,
      encoder=parts.encoder,
    ),
  )


def make_run(
  config: RunConfig, parts: Parts, folder: RunFolder, progress_bar: bool
) -> Run:
  """The run; raises ValueError if parts do not fit or files are damaged."""
  is_supervised = ALGORITHMS[config.algorithm].is_supervised
  replay = None if is_supervised else make_replay(config, parts, folder.replay)

  def evaluate(env_step: int) -> list[EvaluationRow]:
    return evaluation.evaluate(
      functools.partial(config.environment_spec.build, True),
      functools.partial(policies.stored_policy, os.fspath(folder.path)),
      parts.tasks,
      config.evaluation_episodes,
      config.evaluation_seed,
      config.evaluation_workers or command.cores(),
      progress_bar,
      env_step,
      draws=config.environment_spec.may_draw,
    )

  return Run(
    folder,
    make_agent(config, parts, replay),
    parts.environment,
    replay,
    _schedule(config, progress_bar),
    evaluate,
    config.to_dict(),
    seeding.derive(config.seed, "environment"),
  )


def _schedule(config: RunConfig, progress_bar: bool) -> TrainSchedule:
  warm_up = config.warm_up
  if config.transfer_from:  # there is a replay from the start
    warm_up = min(warm_up, config.agent.batch_size, config.replay_capacity)
  return TrainSchedule(
    env_steps=config.env_steps,
    log_every=config.log_every,
    evaluate_every=config.evaluate_every,
    checkpoint_every=config.checkpoint_every,
    warmup_steps=warm_up,
    random_steps=config.random_steps,
    updates_per_step=config.updates_per_step,
    evaluate_first=config.evaluate_first,
    progress_bar=progress_bar,
  )
