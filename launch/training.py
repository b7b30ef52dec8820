"""One run from its config: environment, demonstrations, agent, loop, files."""

import functools
import os
import pathlib
import shutil
from typing import Any

import dm_env
import safetensors.numpy
import torch

from lfgp_dmc import seeding, task_names
from lfgp_dmc.acting import environments, evaluation
from lfgp_dmc.data import files
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import (
  command,
  datasets,
  environment_spec,
  initialise_run,
  policies,
)
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import ALGORITHMS, RunConfig, from_dict
from lfgp_dmc.remote_acting import RemoteActor
from lfgp_dmc.runs import loop, resuming, run_folder, supervised
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.run_folder import RunFolder

_ARRAYS = "policy.safetensors"
_DETERMINISTIC_CUBLAS = ":4096:8"


def train(
  config: RunConfig,
  path: pathlib.Path,
  resume: bool = False,
  progress_bar: bool = True,
) -> loop.Progress:
  """Trains, or goes on training, in a run's folder.

  Args:
    config: the resolved config.
    path: the run's folder; it exists exactly if `resume`.
    resume: whether to continue from its last good checkpoint.
    progress_bar: whether to show one.

  Returns:
    The loop's counters; fewer steps than asked for mean it was stopped.

  Raises:
    UserError: bad input; nothing was written, and no folder is left behind.
  """
  if not resume and path.exists():
    raise UserError(
      f"{path} exists; continue it with --resume, or choose another --run"
    )
  device = set_up_torch(config)
  with command.checked_input():
    environment = _build_world(config)
    tasks = tasks_of(config, environment)
    widths = environments.widths(environment)
  shown = datasets.load(config, tasks, widths)
  if shown:
    print(f"demonstrations: {config.demonstrations}, {datasets.pairs(shown)}")
  with command.checked_input():
    if resume:
      folder = run_folder.resume(path, config.to_dict(), _with_newer_fields)
    else:
      folder = run_folder.create(path, config.to_dict())
  try:
    run = _Run(config, folder, environment, tasks, shown, device)
    if resume:
      run.restore()
    else:
      run.start()
  except (ValueError, OSError) as error:
    if not resume:  # it cannot start: as if it had not been tried
      shutil.rmtree(path)
    raise UserError(str(error)) from error
  return run.train(progress_bar)


def tasks_of(
  config: RunConfig, environment: dm_env.Environment
) -> tuple[str, ...]:
  """The tasks that are learned, the main task first."""
  if not ALGORITHMS[config.algorithm].is_multitask:
    return (config.main_task,)
  if config.environment:
    return environment_spec.tasks_of(environment, config.main_task)
  return task_names.task_set(config.main_task)


def set_up_torch(config: RunConfig) -> torch.device:
  """Threads, determinism and device, before any work.

  Raises:
    UserError: there is no such device.
  """
  torch.set_num_threads(config.threads or command.cores())
  if config.deterministic:
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", _DETERMINISTIC_CUBLAS)
    torch.use_deterministic_algorithms(True)
  name = config.device
  if name == "auto":
    name = "cuda" if torch.cuda.is_available() else "cpu"
  try:
    device = torch.device(name)
    torch.zeros(1, device=device)
  except (RuntimeError, AssertionError, NotImplementedError) as error:
    reason = str(error).partition("\n")[0]
    raise UserError(
      f"config.device is {config.device!r}: {reason}; valid: auto, cpu, or "
      "cuda where this build of torch finds one"
    ) from None
  return device


def evaluate_policy(
  config: RunConfig,
  folder: pathlib.Path,
  tasks: tuple[str, ...],
  env_step: int,
  progress_bar: bool,
) -> list[evaluation.EvaluationRow]:
  """Plays the stored policy: every task, the config's episodes and seed."""
  return evaluation.evaluate(
    config.world.factory(show_rewards=True),
    functools.partial(policies.stored_policy, os.fspath(folder)),
    tasks,
    config.evaluation_episodes,
    config.evaluation_seed,
    config.evaluation_workers or command.cores(),
    progress_bar,
    env_step,
  )


def write_untrained_policy(config: RunConfig, folder: pathlib.Path) -> None:
  """Stores the policy of this config's agent before it learns anything.

  Args:
    config: of a run whose demonstrations are there.
    folder: an existing folder.
  """
  device = set_up_torch(config)
  environment = _build_world(config)
  tasks = tasks_of(config, environment)
  widths = environments.widths(environment)
  stored = _reward_tasks(config, environment, tasks)
  environment.close()
  shown = datasets.load(config, tasks, widths)
  replay = Replay(1, *widths, reward_tasks=stored)
  agent = _build_agent(config, tasks, shown, replay, device, widths)
  _write_policy(folder, config, agent, env_step=0)


def _with_newer_fields(stored: dict[str, Any]) -> dict[str, Any]:
  return from_dict(stored).to_dict()


class _Run:
  """The parts of one run, put together."""

  def __init__(
    self,
    config: RunConfig,
    run: RunFolder,
    environment: dm_env.Environment,
    tasks: tuple[str, ...],
    shown: dict[str, Demonstrations],
    device: torch.device,
  ):
    self._config, self._run, self._tasks = config, run, tasks
    self._environment = environment
    widths = environments.widths(environment)
    self._replay = None
    if not ALGORITHMS[config.algorithm].is_supervised:
      stored = _reward_tasks(config, environment, tasks)
      self._replay = _open_replay(config, run, widths, stored)
    self._agent = _build_agent(
      config, tasks, shown, self._replay, device, widths
    )
    self._log = MetricsLog(run.path)
    self._progress = loop.Progress()

  def start(self) -> None:
    """Takes over what the config says from other runs and policies."""
    initialise_run.start(self._config, self._agent, self._replay)

  def restore(self) -> None:
    """Goes back to the last good checkpoint, or to the start without one."""
    self._progress = resuming.restore(
      self._run, self._agent, self._replay, self._log
    )
    if not self._progress.env_step:
      self.start()

  def train(self, progress_bar: bool) -> loop.Progress:
    """Runs the loop to its end or to a signal."""
    self._progress_bar = progress_bar
    self._save_policy(self._progress.env_step)
    schedule = _schedule(self._config, progress_bar)
    remote = None
    try:
      if self._replay is None:
        return supervised.train(
          self._agent,
          schedule,
          self._log,
          self._evaluate,
          self._checkpoint,
          progress=self._progress,
        )
      if self._config.actor_process:
        remote = self._make_remote_actor(self._replay.reward_tasks)
      return loop.train(
        self._environment,
        self._agent,
        self._replay,
        schedule,
        self._log,
        self._evaluate,
        self._checkpoint,
        seed=seeding.derive(self._config.seed, "environment"),
        progress=self._progress,
        remote=remote,
      )
    finally:
      if remote is not None:
        remote.close()
      self._log.close()
      self._environment.close()

  def _make_remote_actor(self, reward_tasks: tuple[str, ...]) -> RemoteActor:
    config = self._config
    return RemoteActor(
      config.world.factory(config.keeps_rewards),
      functools.partial(policies.sampling_policy, self._agent.policy_options()),
      reward_tasks,
    )

  def _evaluate(self, env_step: int) -> dict[str, float]:
    self._save_policy(env_step)
    rows = evaluate_policy(
      self._config, self._run.path, self._tasks, env_step, self._progress_bar
    )
    evaluation.append_csv(self._run.evaluation, rows)
    return evaluation.success_rates(rows)

  def _checkpoint(self, progress: loop.Progress) -> None:
    self._save_policy(progress.env_step)
    resuming.save(
      self._run, self._agent, self._replay, progress, self._config.env_steps
    )

  def _save_policy(self, env_step: int) -> None:
    _write_policy(self._run.path, self._config, self._agent, env_step)


def _open_replay(
  config: RunConfig,
  run: RunFolder,
  widths: tuple[int, int],
  reward_tasks: tuple[str, ...],
) -> Replay:
  # A full ring must still hold the rows of the last checkpoint.
  episode = getattr(config.agent, "episode_steps", 0)
  is_ring = config.replay_capacity < config.env_steps or config.transfer_from
  return Replay(
    config.replay_capacity,
    *widths,
    run.replay,
    slack=config.checkpoint_every + 2 * episode if is_ring else 0,
    reward_tasks=reward_tasks,
  )


def _build_world(config: RunConfig) -> dm_env.Environment:
  return config.world.build(config.keeps_rewards)


def _reward_tasks(
  config: RunConfig, environment: dm_env.Environment, tasks: tuple[str, ...]
) -> tuple[str, ...]:
  """Whose dense rewards the replay keeps; all there are, for transfers."""
  if not config.keeps_rewards:
    return ()
  return environments.tasks_with_rewards(environment, tasks)


def _build_agent(config, tasks, shown, replay, device, widths):
  return ALGORITHMS[config.algorithm].build(
    config.agent,
    tasks,
    shown,
    replay,
    seeding.derive(config.seed, "agent"),
    device,
    *widths,
  )


def _write_policy(
  folder: pathlib.Path, config: RunConfig, agent, env_step: int
) -> None:
  """Makes a folder the policy folder of the agent's present policy."""
  with files.replacing(folder / _ARRAYS) as aside:
    safetensors.numpy.save_file(agent.policy_arrays(), aside)
  options = {**agent.policy_options(), "env_step": env_step}
  files.write_json(
    folder / run_folder.CONFIG_NAME, {**config.to_dict(), "policy": options}
  )


def _schedule(config: RunConfig, progress_bar: bool) -> loop.TrainSchedule:
  pace = {}
  if not ALGORITHMS[config.algorithm].is_supervised:
    pace["warmup_steps"] = config.agent.warm_up
    if config.transfer_from:  # there is a replay from the start
      pace["warmup_steps"] = min(config.agent.warm_up, config.agent.batch_size)
    pace["updates_per_step"] = config.agent.updates_per_step
  return loop.TrainSchedule(
    env_steps=config.env_steps,
    log_every=config.log_every,
    evaluate_every=config.evaluate_every,
    checkpoint_every=config.checkpoint_every,
    evaluate_first=config.evaluate_first,
    progress_bar=progress_bar,
    **pace,
  )
