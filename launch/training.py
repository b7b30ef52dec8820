"""Trains by a config, in a run's folder: new, or continued."""

import pathlib
import shutil
from typing import Any

from lfgp_dmc.agents.lfgp import LfgpAgent
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import assemble, command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig, from_dict
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.runs.schedule import Progress
from lfgp_dmc.types import Agent


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
  parts = assemble.make_parts(config, path if resume else None)
  if found := parts.demonstrations:
    pairs = sum(map(len, found.values()))
    print(
      f"demonstrations: {config.demonstrations}, {len(found)} tasks, "
      f"{pairs} pairs"
    )
  with command.checked_input():
    if resume:
      folder = run_folder.resume(path, config.to_dict(), _with_newer_fields)
    else:
      folder = run_folder.create(path, config.to_dict())
  try:
    run = assemble.make_run(config, parts, folder, progress_bar)
    if not (resume and run.restore()):
      _initialise(config, run.agent, run.replay)
  except (ValueError, OSError) as error:
    if not resume:  # it cannot start: as if it had not been tried
      shutil.rmtree(path)
    raise UserError(str(error)) from error
  return run.train()


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
  if not isinstance(agent, LfgpAgent) or replay is None:
    raise ValueError(
      f"config.transfer_from is {config.transfer_from!r}; valid: nothing, "
      f"since {config.algorithm} keeps no replay"
    )
  if config.transfer_from:
    _transfer(config, agent, replay)
  if config.init_from:
    agent.start_from(Policy.load(config.init_from))
    print(f"the intentions start as those of {config.init_from}")


def _transfer(config: RunConfig, agent: LfgpAgent, replay: Replay) -> None:
  """Section 5.2 of the paper: networks by task name, and the whole replay."""
  source = RunFolder(pathlib.Path(config.transfer_from))
  try:
    tasks = run_folder.read_config(source.path)["policy"]["tasks"]
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
  agent.carry_over(
    networks, tasks, config.transfer_updates, config.transfer_main_head
  )
  rows = replay.copy_from(Replay.stored(source.replay))
  print(f"took over {path.name} of {source.path} with {rows} transitions")
