"""The training loop without an environment: epochs of updates on fixed data.

The counterpart of `loop.py` for learners that only imitate. There are no
environment steps: `env_step` in rows and file names is the number of updates,
so that the files of all runs read alike.
"""

import time
from typing import Any, Protocol

import tqdm

from lfgp_dmc.runs.loop import (
  CheckpointFn,
  EvaluateFn,
  Progress,
  TrainSchedule,
  passed,
)
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.signals import StopRequest, stop_request
from lfgp_dmc.types import Metrics


class Learner(Protocol):
  """What learns by epochs, as this loop sees it."""

  @property
  def has_converged(self) -> bool:
    """Whether nothing more is to be gained; checked between epochs."""

  def begin_epoch(self) -> int:
    """Shuffles the data; returns how many updates the epoch has."""

  def update(self) -> None:
    """Makes one update, on the epoch's next batch."""

  def end_epoch(self) -> None:
    """Validates, also after an epoch that was cut by the run's end."""

  def metrics(self) -> Metrics:
    """Means since the last call; the names stay the same."""


def train(
  learner: Learner,
  schedule: TrainSchedule,
  log: MetricsLog,
  evaluate_fn: EvaluateFn | None = None,
  checkpoint_fn: CheckpointFn | None = None,
  *,
  progress: Progress | None = None,
) -> Progress:
  """Trains until the learner converges, at most `schedule.env_steps` updates.

  Evaluations and checkpoints fall on ends of epochs. SIGINT or SIGTERM finishes
  the epoch and writes a checkpoint, without rows or an evaluation that were not
  due, so that the resumed run equals one never stopped.

  Args:
    learner: shuffles, updates, validates.
    schedule: when things happen, in updates; what it says about environment
      steps has no meaning here.
    log: gets a row each `log_every` updates and a last one.
    evaluate_fn: update -> success rate by task; writes its own rows.
    checkpoint_fn: stores learner and the progress it is given.
    progress: of the checkpoint that is being resumed.

  Returns:
    The progress; `is_complete` tells whether it was stopped.
  """
  run = _Supervised(learner, schedule, log, progress or Progress())
  with stop_request() as stop:
    run.run(stop, evaluate_fn, checkpoint_fn)
  return run.progress


class _Supervised:
  """The state of one call of `train`."""

  def __init__(self, learner, schedule, log, progress):
    self.progress: Progress = progress
    self._learner: Learner = learner
    self._schedule: TrainSchedule = schedule
    self._log: MetricsLog = log
    self._start = time.monotonic() - progress.wall_s
    self._row_mark = (self._elapsed(), progress.update)

  def run(
    self,
    stop: StopRequest,
    evaluate_fn: EvaluateFn | None,
    checkpoint_fn: CheckpointFn | None,
  ) -> None:
    """Trains epoch by epoch; evaluates and checkpoints between them."""
    schedule, progress = self._schedule, self.progress
    self._bar = tqdm.tqdm(
      initial=progress.update,
      unit="update",
      disable=not schedule.progress_bar,
      mininterval=1.0,
    )
    with self._bar:
      if schedule.evaluate_first and evaluate_fn and not progress.update:
        self._evaluate(evaluate_fn)
      while not progress.is_complete and not stop:
        before = progress.update
        self._run_epoch()
        update, final = progress.update, progress.is_complete
        due = final or passed(before, update, schedule.evaluate_every)
        if due and evaluate_fn:
          self._evaluate(evaluate_fn)
        due = final or passed(before, update, schedule.checkpoint_every)
        if (due or stop) and checkpoint_fn:
          progress.wall_s = self._elapsed()
          checkpoint_fn(progress)

  def _run_epoch(self) -> None:
    """Makes the updates of one epoch, or those that the run has left.

    A row that is due on the last of them tells the epoch's own validation.
    """
    progress, schedule = self.progress, self._schedule
    updates = self._learner.begin_epoch()
    end = min(progress.update + updates, schedule.env_steps)
    while progress.update < end:
      self._learner.update()
      progress.update += 1
      progress.env_step = progress.update
      self._bar.update()
      if progress.update < end and progress.update % schedule.log_every == 0:
        self._write_row()
    self._learner.end_epoch()
    progress.is_complete = (
      self._learner.has_converged or progress.update >= schedule.env_steps
    )
    if progress.is_complete or progress.update % schedule.log_every == 0:
      self._write_row()

  def _write_row(self) -> None:
    now, update = self._elapsed(), self.progress.update
    then, before = self._row_mark
    self._row_mark = (now, update)
    metrics = self._learner.metrics()
    self._log.write(
      {
        "env_step": update,
        "update": update,
        "wall_s": round(now, 3),
        "updates_per_s": round((update - before) / max(now - then, 1e-9), 3),
        **metrics,
      }
    )
    self._show(metrics)

  def _show(self, metrics: Metrics) -> None:
    """Puts epochs and losses beside the bar."""
    shown: dict[str, Any] = {}
    for name, value in metrics.items():
      if name.endswith("epoch"):
        shown[name] = int(value)
      elif name.startswith("loss/"):
        shown[name.removeprefix("loss/")] = f"{value:.4f}"
    self._bar.set_postfix(shown, refresh=False)

  def _evaluate(self, evaluate_fn: EvaluateFn) -> None:
    rates = evaluate_fn(self.progress.update)
    self._log.write_scalars(
      self.progress.update,
      {f"success/{task}": rate for task, rate in rates.items()},
    )

  def _elapsed(self) -> float:
    return time.monotonic() - self._start
