"""Trains by a config, in a run's folder: new, or continued."""

import dataclasses
import hashlib
import pathlib
import shutil
from typing import Any

import numpy as np
from absl import logging

from lfgp_dmc.agents.lfgp.agent import LfgpAgent
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data import files
from lfgp_dmc.data.demonstration_checks import FRAMES
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import assemble, command, sizes
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig, from_dict
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.runs.schedule import Progress
from lfgp_dmc.types import Agent

# What bad input raises while a run is made.
_INPUT = (ValueError, OSError, OverflowError)


def train(
  config: RunConfig,
  path: pathlib.Path,
  resume: bool = False,
  progress_bar: bool = True,
) -> Progress:
  """Trains in a run's folder: a new one, or on from its last good checkpoint.

  Raises:
    UserError: bad input; nothing was written, and no folder is left behind.
  """
  if not resume and path.exists():
    raise UserError(
      f"{path} exists; continue it with --resume, or choose another --run"
    )
  if config.episode_steps and not (resume or config.environment):
    raise UserError(
      f"config.episode_steps is {config.episode_steps}; valid: 0, the block "
      "tasks' own, or the number of config.environment"
    )
  sizes.check(config, path)
  files.check_writable(path / run_folder.CONFIG_NAME)
  with sizes.told(config):
    return _train(config, path, resume, progress_bar)


def _train(
  config: RunConfig, path: pathlib.Path, resume: bool, progress_bar: bool
) -> Progress:
  """Trains with sizes that may be too large still."""
  sha256 = config.demonstrations_sha256
  if resume:
    with command.checked_input():
      stored = run_folder.read_config(path)
      _check_continues(config, RunFolder(path), stored)
      folder = run_folder.resume(path, config.to_dict(), _with_newer_fields)
    sha256 = stored.get("demonstrations_sha256", "")  # none in older runs
  parts = assemble.make_parts(config, path if resume else None)
  if found := parts.demonstrations:
    pairs = sum(map(len, found.values()))
    print(
      f"demonstrations: {config.demonstrations}, {len(found)} tasks, "
      f"{pairs} pairs"
    )
    config = dataclasses.replace(config, demonstrations_sha256=_sha256(found))
    if sha256 not in ("", config.demonstrations_sha256):
      raise UserError(
        f"config.demonstrations is {config.demonstrations!r}; valid: the same "
        f"data that the run was started with (SHA-256 {sha256})"
      )
  if not resume:
    with command.checked_input():
      folder = run_folder.create(path, config.to_dict())
  is_useless = True
  try:
    run = assemble.make_run(config, parts, folder, progress_bar)
    if not (resume and run.restore()):
      _initialise(config, run.agent, run.replay)
    is_useless = False
    return run.train()
  except BaseException as error:
    is_input = is_useless and isinstance(error, _INPUT)
    if sizes.is_memory_fault(error):  # in the first updates, mostly
      is_useless = checkpoints.latest(folder.checkpoints) is None
    if is_useless and not resume:  # as if it had not been tried
      shutil.rmtree(path)
    if is_input:
      raise UserError(str(error)) from error
    raise


def _check_continues(
  config: RunConfig, folder: RunFolder, stored: dict[str, Any]
) -> None:
  """Raises UserError if starting anew would overwrite what was learned.

  That is a policy folder, or a run that lost its checkpoints: one that was
  killed before the first has learned little.
  """
  if checkpoints.every(folder.checkpoints) or not folder.has_policy:
    return
  step = stored.get(run_folder.POLICY_FIELD, {}).get("env_step", 0)
  end = min(2 * config.checkpoint_every, stored.get("env_steps", 0))
  if step >= end or not folder.is_run:
    raise UserError(
      f"{folder.path} has a policy of step {step}, but no checkpoint to go on "
      "from: put its checkpoints/ back, or start a new run"
    )


def _sha256(found: dict[str, Demonstrations]) -> str:
  """Of all arrays, wherever they lie."""
  digest = hashlib.sha256()
  for task, data in found.items():
    arrays = data.arrays()
    if data.frames is not None:  # observations may be features by now
      del arrays["observation"], arrays["next_observation"]
      arrays[FRAMES] = data.frames
    for name, array in arrays.items():
      digest.update(f"{task} {name} {array.shape}".encode())
      digest.update(np.ascontiguousarray(array).data)
  return digest.hexdigest()


def draw(path: pathlib.Path) -> pathlib.Path | None:
  """Draws a run; where that fails it warns, since what was learned counts."""
  try:
    from lfgp_dmc.study import run_picture  # matplotlib takes its time

    picture = path / run_picture.NAME
    run_picture.draw(path, picture)
    return picture
  except Exception as error:
    logging.warning("no picture of the run: %s", error)
    return None


def write_untrained_policy(config: RunConfig, folder: pathlib.Path) -> None:
  """Stores the policy of this config's agent before it learns anything."""
  parts = assemble.make_parts(config)
  agent = assemble.make_agent(
    config, parts, assemble.make_replay(config, parts)
  )
  parts.environment.close()
  agent.save_policy(folder, config.to_dict(), env_step=0)


def _with_newer_fields(stored: dict[str, Any]) -> dict[str, Any]:
  return from_dict(stored).to_dict()


def _initialise(config: RunConfig, agent: Agent, replay: Replay | None) -> None:
  """Takes over what `transfer_from` and `init_from` name."""
  if not (config.transfer_from or config.init_from):
    return
  assert isinstance(agent, LfgpAgent) and replay is not None, "was checked"
  if config.transfer_from:
    _transfer(config, agent, replay)
  if config.init_from:
    policy = Policy.load(config.init_from)
    stored = run_folder.read_config(config.init_from)
    _check_source(config, "init_from", stored)
    agent.start_from(policy)
    print(f"the intentions start as those of {config.init_from}")


def _check_source(
  config: RunConfig, field: str, stored: dict[str, Any]
) -> None:
  """Raises ValueError if what is taken over means other steps or inputs.

  Sizes of arrays do not tell.
  """
  path = getattr(config, field)
  rate = stored.get("control_hz", config.control_hz)
  if rate != config.control_hz and not config.environment:
    raise ValueError(
      f"config.control_hz is {config.control_hz}; {field} {path} has {rate}"
    )
  own = dataclasses.asdict(config.agent.inputs)
  theirs = {
    **stored.get("agent", {}).get("inputs", {}),
    **stored.get(run_folder.POLICY_FIELD, {}),
  }
  for name, value in own.items():
    # Standardisation comes along with the networks, if they have it.
    is_brought = name == "standardise" and not value
    if theirs.get(name, value) != value and not is_brought:
      raise ValueError(
        f"config.agent.inputs.{name} is {value}; {field} {path} has "
        f"{theirs[name]}"
      )


def _transfer(config: RunConfig, agent: LfgpAgent, replay: Replay) -> None:
  """Section 5.3 of the paper: networks by task name, and the whole replay."""
  source = RunFolder(pathlib.Path(config.transfer_from))
  try:
    stored = run_folder.read_config(source.path)
    tasks = stored[run_folder.POLICY_FIELD]["tasks"]
    path = checkpoints.latest(source.checkpoints)
    if path is None:
      raise ValueError(f"{source.path} has no good checkpoint yet")
    networks = checkpoints.load(path)["agent"]["learner"]["networks"]
  except KeyError as error:
    raise ValueError(
      f"config.transfer_from: {source.path} is no run to transfer from: it has "
      f"no {error}"
    ) from None
  except ValueError as error:
    raise ValueError(f"config.transfer_from: {error}") from None
  _check_source(config, "transfer_from", stored)
  agent.carry_over(
    networks, tasks, config.transfer_updates, config.transfer_main_head
  )
  rows = replay.copy_from(Replay.stored(source.replay))
  print(f"took over {path.name} of {source.path} with {rows} transitions")
