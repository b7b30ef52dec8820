"""What a new run takes over: another run's learning, or a stored policy."""

import pathlib
from typing import Any

from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.data.stored_replay import StoredReplay
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder


def start(config: RunConfig, agent: Any, replay: Replay | None) -> None:
  """Carries over what `transfer_from` and `agent.init_from` name.

  Args:
    config: of the new run.
    agent: freshly built.
    replay: empty; gets the other run's transitions. None: there is none.

  Raises:
    ValueError: the other folder cannot be used for this run; the message says
      why.
  """
  if config.transfer_from:
    if replay is None:
      raise ValueError(
        f"config.transfer_from is {config.transfer_from!r}; valid: nothing, "
        f"since {config.algorithm} keeps no replay"
      )
    _transfer(RunFolder(pathlib.Path(config.transfer_from)), agent, replay)
  if init_from := getattr(config.agent, "init_from", ""):
    agent.start_from(Policy.load(init_from))
    print(f"the intentions start as those of {init_from}")


def _transfer(source: RunFolder, agent: Any, replay: Replay) -> None:
  """Section 5.2 of the paper: networks by task name, and the whole replay."""
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
  agent.carry_over(networks, tasks)
  rows = carry_replay(StoredReplay(source.replay), replay)
  print(f"took over {path.name} of {source.path} with {rows} transitions")


def carry_replay(source: StoredReplay, replay: Replay) -> int:
  """Adds another run's transitions, the newest that there is room for.

  Args:
    source: the other run's.
    replay: where to; where it keeps rewards, they are picked by task name.

  Returns:
    How many.

  Raises:
    ValueError: widths differ, or the source keeps no rewards of some task.
  """
  if source.widths != replay.widths:
    raise ValueError(
      f"the other run's observations and actions have {source.widths} floats; "
      f"this world has {replay.widths}"
    )
  kept, wanted = source.reward_tasks, replay.reward_tasks
  missing = [task for task in wanted if task not in kept]
  if missing:
    raise ValueError(
      f"the other run's replay keeps no rewards of {', '.join(missing)}; it "
      f"keeps: {', '.join(kept) or 'none'}"
    )
  columns = [kept.index(task) for task in wanted]
  for transitions, rewards in source.chunks(newest=replay.capacity):
    picked = None
    if rewards is not None and columns:
      picked = rewards[:, columns]
    replay.add_batch(transitions, picked)
  return len(replay)
