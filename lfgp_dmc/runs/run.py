"""A whole run: trained, evaluated, stored, and brought back.

The replay reaches the disk before the checkpoint that counts its rows, so a
kill between the two leaves a replay that is ahead, and it is rewound.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import dm_env
from absl import logging

from lfgp_dmc.data import csv_files, evaluation_csv
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs import checkpoints
from lfgp_dmc.runs.loop import EpisodeRounds
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.rounds import Rounds
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.runs.schedule import Progress, TrainSchedule
from lfgp_dmc.runs.supervised import EpochRounds
from lfgp_dmc.types import ActingAgent, SupervisedAgent


class Run:
  """The parts of one run, put together."""

  def __init__(
    self,
    folder: RunFolder,
    agent: ActingAgent | SupervisedAgent,
    environment: dm_env.Environment,
    replay: Replay | None,
    schedule: TrainSchedule,
    evaluate: Callable[[int], Sequence[evaluation_csv.EvaluationRow]],
    config: Mapping[str, Any],
    seed: int = 0,
  ):
    """Opens the log.

    Args:
      folder: locked.
      agent: freshly built.
      environment: of an acting agent, like `replay` and `seed`.
      replay: opened from the folder.
      schedule: when things happen.
      evaluate: env_step -> episodes of the policy that the folder holds.
      config: the content of `config.json`.
      seed: of the episodes' starts.
    """
    self.agent, self.replay = agent, replay
    self._folder = folder
    self._environment = environment
    self._schedule = schedule
    self._evaluate_policy = evaluate
    self._config = config
    self._seed = seed
    self._log = MetricsLog(folder.path)
    self._progress = Progress()

  def train(self) -> Progress:
    """Trains to the end or to a signal; see `Rounds`."""
    self._save_policy(self._progress.env_step)
    shared = self._schedule, self._log, self._progress
    rounds: Rounds
    if isinstance(self.agent, SupervisedAgent):
      rounds = EpochRounds(self.agent, *shared)
    else:
      assert self.replay is not None, "an acting agent has a replay"
      rounds = EpisodeRounds(
        self._environment, self.agent, self.replay, *shared, self._seed
      )
    try:
      return rounds.run(self._evaluate, self._checkpoint)
    finally:
      self._log.close()
      self._environment.close()

  def restore(self) -> bool:
    """Goes back to the newest good checkpoint, or to the start without one.

    The CSV files are cut back to it. A replay that lost the checkpoint's rows
    is emptied, with a warning, and the loop refills it before it updates again.
    Returns whether there was a checkpoint.

    Raises:
      CheckpointError: there are checkpoints, all damaged, or of another
        version; nothing was changed.
    """
    folder = self._folder
    path = checkpoints.latest(folder.checkpoints)
    if path is None and checkpoints.every(folder.checkpoints):
      raise checkpoints.CheckpointError(
        f"every checkpoint in {folder.checkpoints} is damaged"
      )
    replay_total, last_step = 0, -1
    if path is None:
      logging.warning("%s has no checkpoint yet: starting anew", folder.path)
    else:
      state = checkpoints.load(path)
      try:
        self.agent.load_state_dict(state["agent"])
      except KeyError as error:
        raise checkpoints.CheckpointError(
          f"{path} is of another version: it has no {error}"
        ) from None
      self._progress = Progress(**state["progress"])
      # Its end may be later than it was.
      self._progress.is_complete = (
        isinstance(self.agent, SupervisedAgent) and self.agent.has_converged
      )
      replay_total, last_step = state["replay_total"], self._progress.env_step
      logging.info("resuming from %s", path)
    if self.replay is not None:
      _rewind(self.replay, replay_total)
    self._log.truncate_after(last_step)
    csv_files.truncate_after(folder.evaluation, last_step)
    return path is not None

  def _evaluate(self, env_step: int) -> dict[str, float]:
    self._save_policy(env_step)
    rows = self._evaluate_policy(env_step)
    # Rows may be there of a kill between here and the checkpoint.
    evaluation_csv.replace_csv(self._folder.evaluation, rows)
    return evaluation_csv.success_rates(rows)

  def _checkpoint(self, progress: Progress) -> None:
    """Stores everything; a failed write leaves earlier checkpoints as is."""
    self._save_policy(progress.env_step)
    if self.replay is not None:
      self.replay.flush()
    state = {
      "agent": self.agent.state_dict(),
      "progress": dataclasses.asdict(progress),
      "replay_total": 0 if self.replay is None else self.replay.total,
    }
    checkpoints.save(
      self._folder.checkpoints,
      progress.env_step,
      state,
      self._schedule.env_steps,
    )

  def _save_policy(self, env_step: int) -> None:
    self.agent.save_policy(self._folder.path, self._config, env_step)


def _rewind(replay: Replay, total: int) -> None:
  if not total:  # of before the first checkpoint
    replay.clear()
    return
  try:
    replay.rewind(total)
  except ValueError as error:
    logging.warning("%s; refilling the replay before further updates", error)
    replay.clear()
