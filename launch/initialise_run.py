"""What a new run takes over: another run's learning, or a stored policy."""

import pathlib

from lfgp_dmc.agents.lfgp import LfgpAgent
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.types import Agent


def initialise(config: RunConfig, agent: Agent, replay: Replay | None) -> None:
  """Carries over what `transfer_from` and `init_from` name.

  Args:
    config: of the new run.
    agent: freshly built.
    replay: empty; gets the other run's transitions. None: there is none.

  Raises:
    ValueError: the other folder cannot be used for this run; the message says
      why.
  """
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
  agent.carry_over(networks, tasks, config.transfer_updates)
  rows = replay.copy_from(Replay.stored(source.replay))
  print(f"took over {path.name} of {source.path} with {rows} transitions")
