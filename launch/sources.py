"""What a run starts from: another run, or the intentions of a policy."""

import dataclasses
import pathlib
from typing import Any

from lfgp_dmc.agents.lfgp.agent import LfgpAgent
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.types import Agent


def take_over(config: RunConfig, agent: Agent, replay: Replay | None) -> None:
  """Takes over what `transfer_from` and `init_from` name.

  Raises:
    ValueError: there is nothing of that kind, or it does not fit the config.
  """
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
