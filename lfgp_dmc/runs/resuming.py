"""A whole run stored and brought back: agent, counters, replay, CSV files.

The replay reaches the disk before the checkpoint that counts its rows, so a
kill between the two leaves a replay that is ahead, and it is rewound.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, Protocol

from absl import logging

from lfgp_dmc.data import csv_files
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs import checkpoints
from lfgp_dmc.runs.loop import Progress
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.run_folder import RunFolder


class Resumable(Protocol):
  """What a checkpoint needs of an agent."""

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values: everything but the replay."""

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""


def save(
  run: RunFolder,
  agent: Resumable,
  replay: Replay | None,
  progress: Progress,
  run_steps: int | None = None,
) -> None:
  """Writes a checkpoint at an episode's or epoch's end.

  Args:
    run: the run's folder.
    agent: gives its `state_dict`.
    replay: flushed; a replay in memory is not stored. None: there is none.
    progress: the loop's counters.
    run_steps: length of the whole run, for which checkpoints are kept.

  Raises:
    OSError: it could not be written; earlier checkpoints are untouched.
  """
  if replay is not None:
    replay.flush()
  state = {
    "agent": agent.state_dict(),
    "progress": dataclasses.asdict(progress),
    "replay_total": 0 if replay is None else replay.total,
  }
  checkpoints.save(run.checkpoints, progress.env_step, state, run_steps)


def restore(
  run: RunFolder, agent: Resumable, replay: Replay | None, log: MetricsLog
) -> Progress:
  """Goes back to the newest good checkpoint, or to the start without one.

  The CSV files are cut back to it. A replay that lost the checkpoint's rows is
  emptied, with a warning, and the loop refills it before it updates again.

  Args:
    run: the run's folder.
    agent: freshly built; gets `load_state_dict`.
    replay: opened from the run's folder; None: there is none.
    log: the run's metrics.

  Returns:
    The progress to hand to `loop.train`.

  Raises:
    CheckpointError: there are checkpoints, all damaged; nothing was changed.
  """
  path = checkpoints.latest(run.checkpoints)
  if path is None and checkpoints.every(run.checkpoints):
    raise checkpoints.CheckpointError(
      f"every checkpoint in {run.checkpoints} is damaged; without that folder "
      "--resume starts the run anew"
    )
  progress, replay_total, last_step = Progress(), 0, -1
  if path is None:
    logging.warning("%s has no checkpoint yet: starting anew", run.path)
  else:
    state = checkpoints.load(path)
    agent.load_state_dict(state["agent"])
    progress = Progress(**state["progress"])
    replay_total, last_step = state["replay_total"], progress.env_step
    logging.info("resuming from %s", path)
  if replay is not None:
    _rewind(replay, replay_total)
  log.truncate_after(last_step)
  csv_files.truncate_after(run.evaluation, last_step)
  return progress


def _rewind(replay: Replay, total: int) -> None:
  try:
    replay.rewind(total)
  except ValueError as error:
    logging.warning("%s; refilling the replay before further updates", error)
    replay.clear()
