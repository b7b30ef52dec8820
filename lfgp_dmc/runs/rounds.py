"""What all training loops share: rounds, with rows and files between them."""

import abc
import time
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

from absl import logging

from lfgp_dmc import progress_bars, signals
from lfgp_dmc.acting.workers import LostWorkerError
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.schedule import Progress, TrainSchedule
from lfgp_dmc.types import Agent, Metrics

EvaluateFn = Callable[[int], Mapping[str, float]]
CheckpointFn = Callable[[Progress], object]
_Agent = TypeVar("_Agent", bound=Agent)


class Rounds(abc.ABC, Generic[_Agent]):
  """Trains by rounds, an episode or an epoch each, until the run's end.

  Evaluations and checkpoints fall on ends of rounds. A signal finishes the
  round, not an evaluation, and writes a checkpoint, without rows that were not
  due, so that the resumed run equals one never stopped.
  """

  _unit, _label = "step", "training"  # of the progress bar
  _has_known_end = True

  def __init__(
    self,
    agent: _Agent,
    schedule: TrainSchedule,
    log: MetricsLog,
    progress: Progress | None = None,
  ):
    """Starts the clock; `progress` is of a checkpoint that is resumed."""
    self.progress = progress or Progress()
    self._agent = agent
    self._schedule = schedule
    self._log = log
    self._start = time.monotonic() - self.progress.wall_s
    self._mark = self._counts()  # of the last row

  def run(
    self,
    evaluate_fn: EvaluateFn | None = None,
    checkpoint_fn: CheckpointFn | None = None,
  ) -> Progress:
    """Trains to the end, or to a signal; returns how far it came.

    Args:
      evaluate_fn: env_step -> success rate by task; writes its own rows, whole
        or torn by a signal.
      checkpoint_fn: stores the agent, its data and the progress it is given.

    Raises:
      LostWorkerError: in an evaluation; a checkpoint was written.
    """
    self._functions = evaluate_fn, checkpoint_fn
    schedule, progress = self._schedule, self.progress
    progress.is_complete |= progress.env_step >= schedule.env_steps
    progress.evaluation_due |= schedule.evaluate_first and not progress.env_step
    self._bar = progress_bars.bar(
      total=schedule.env_steps if self._has_known_end else None,
      initial=progress.env_step,
      desc=self._label,
      unit=self._unit,
      show=schedule.progress_bar,
      mininterval=1.0,
    )
    with self._bar, signals.stop_request() as stop:
      try:
        with stop.at_once():
          self._begin()
      except signals.StopError:
        logging.warning("stopped before the first step: nothing is stored")
        return progress
      if progress.evaluation_due or stop:
        self._close_round(progress.is_complete, stop)
      while not progress.is_complete and not stop:
        before = progress.env_step
        self._round()
        step, final = progress.env_step, progress.is_complete
        due = final or passed(before, step, schedule.evaluate_every)
        progress.evaluation_due = due
        due = final or passed(before, step, schedule.checkpoint_every)
        self._close_round(due, stop)
    progress.is_complete &= not progress.evaluation_due
    return progress

  def _close_round(self, is_due: bool, stop: signals.StopRequest) -> None:
    """Evaluates and writes a checkpoint, if due.

    An evaluation that a stop or a lost process ends is left to a resumed run.
    """
    evaluate_fn, checkpoint_fn = self._functions
    progress, lost = self.progress, None
    try:
      if progress.evaluation_due and evaluate_fn:
        with stop.at_once():
          rates = evaluate_fn(progress.env_step)
        self._show_success(rates)
      progress.evaluation_due = False
    except signals.StopError:
      pass
    except LostWorkerError as error:
      lost = error
    if (is_due or stop or lost) and checkpoint_fn:
      progress.wall_s = self._elapsed()
      checkpoint_fn(progress)
    if lost and not stop:
      raise lost

  def _begin(self) -> None:
    """Work before the first round, if any."""

  @abc.abstractmethod
  def _round(self) -> None:
    """Makes a round: counts, writes rows that are due, notes the run's end."""

  def _rates(self, seconds: float, steps: int, updates: int) -> dict[str, Any]:
    """Columns of a row between `wall_s` and the agent's own metrics."""
    del steps
    return {"updates_per_s": round(updates / seconds, 3)}

  def _write_row(self) -> Metrics:
    """Writes what happened since the last row; returns the agent's metrics."""
    progress, before = self.progress, self._mark
    self._mark = now = self._counts()
    seconds, steps, updates = (a - b for a, b in zip(now, before, strict=True))
    metrics = self._agent.metrics()
    row = {
      "env_step": progress.env_step,
      "update": progress.update,
      "wall_s": round(now[0], 3),
    }
    row |= self._rates(max(seconds, 1e-9), int(steps), int(updates))
    self._log.write({**row, **metrics})
    return metrics

  def _show_success(self, rates: Mapping[str, float]) -> None:
    self._log.write_scalars(
      self.progress.env_step,
      {f"success/{task}": rate for task, rate in rates.items()},
    )
    self._bar.set_postfix({k: f"{rate:.0%}" for k, rate in rates.items()})

  def _counts(self) -> tuple[float, int, int]:
    return self._elapsed(), self.progress.env_step, self.progress.update

  def _elapsed(self) -> float:
    return time.monotonic() - self._start


def passed(before: int, now: int, every: int) -> bool:
  """Whether a multiple of `every` lies in (before, now]."""
  return before // every != now // every
