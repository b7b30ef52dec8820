"""Trains by a config, in a run's folder: new, or continued."""

import dataclasses
import hashlib
import pathlib
import shutil
from typing import Any

import numpy as np
from absl import logging

from lfgp_dmc.data import files
from lfgp_dmc.data.demonstration_checks import FRAMES
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.launch import assemble, command, sizes, sources
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig, from_dict
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.runs.schedule import Progress

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
      sources.take_over(config, run.agent, run.replay)
    is_useless = False
    return run.train()
  except BaseException as error:
    is_input = is_useless and isinstance(error, _INPUT)
    if sizes.is_memory_fault(error):  # in the first updates, mostly
      is_useless = checkpoints.latest(folder.checkpoints) is None
    if is_useless and not resume:  # as if it had not been tried
      shutil.rmtree(path)
    if is_input and not sizes.is_memory_fault(error):
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
