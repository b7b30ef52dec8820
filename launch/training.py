"""Trains by a config, in a run's folder: new, or continued."""

import pathlib
import shutil
from typing import Any

from lfgp_dmc.launch import assemble, command, datasets, initialise_run
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig, from_dict
from lfgp_dmc.runs import run_folder
from lfgp_dmc.runs.schedule import Progress


def train(
  config: RunConfig,
  path: pathlib.Path,
  resume: bool = False,
  progress_bar: bool = True,
) -> Progress:
  """Trains in a run's folder: a new one, or on from its last good checkpoint.

  Returns:
    How far it came; not complete if it was stopped.

  Raises:
    UserError: bad input; nothing was written, and no folder is left behind.
  """
  if not resume and path.exists():
    raise UserError(
      f"{path} exists; continue it with --resume, or choose another --run"
    )
  parts = assemble.make_parts(config)
  if shown := parts.demonstrations:
    print(f"demonstrations: {config.demonstrations}, {datasets.pairs(shown)}")
  with command.checked_input():
    if resume:
      folder = run_folder.resume(path, config.to_dict(), _with_newer_fields)
    else:
      folder = run_folder.create(path, config.to_dict())
  try:
    run = assemble.make_run(config, parts, folder, progress_bar)
    if not (resume and run.restore()):
      initialise_run.initialise(config, run.agent, run.replay)
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
