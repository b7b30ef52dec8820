"""The training loop without an environment: epochs of updates on fixed data.

There are no environment steps: `env_step` in rows and file names is the number
of updates, so that the files of all runs read alike.
"""

from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.rounds import CheckpointFn, EvaluateFn, Rounds
from lfgp_dmc.runs.schedule import Progress, TrainSchedule
from lfgp_dmc.types import Metrics, SupervisedAgent


def train(
  agent: SupervisedAgent,
  schedule: TrainSchedule,
  log: MetricsLog,
  evaluate_fn: EvaluateFn | None = None,
  checkpoint_fn: CheckpointFn | None = None,
  *,
  progress: Progress | None = None,
) -> Progress:
  """Trains until the agent converges, at most `schedule.env_steps` updates.

  See `Rounds` for the arguments.
  """
  return _Epochs(agent, schedule, log, progress).run(evaluate_fn, checkpoint_fn)


class _Epochs(Rounds[SupervisedAgent]):
  """The state of one call of `train`."""

  _unit = "update"

  def _round(self) -> None:
    """Makes the updates of one epoch, or those that the run has left.

    A row that is due on the last of them has the epoch's own validation.
    """
    progress, schedule = self.progress, self._schedule
    updates = self._agent.begin_epoch()
    end = min(progress.update + updates, schedule.env_steps)
    while progress.update < end:
      self._agent.update()
      progress.update += 1
      progress.env_step = progress.update
      self._bar.update()
      if progress.update < end and progress.update % schedule.log_every == 0:
        self._write_row()
    self._agent.end_epoch()
    progress.is_complete = (
      self._agent.has_converged or progress.update >= schedule.env_steps
    )
    if progress.is_complete or progress.update % schedule.log_every == 0:
      self._write_row()

  def _write_row(self) -> Metrics:
    """Also shows epochs and losses beside the bar."""
    metrics = super()._write_row()
    shown = {k: int(v) for k, v in metrics.items() if k.endswith("epoch")}
    losses = {
      name.removeprefix("loss/"): f"{value:.4f}"
      for name, value in metrics.items()
      if name.startswith("loss/")
    }
    self._bar.set_postfix(shown | losses, refresh=False)
    return metrics
