"""The training loop without an environment: epochs of updates on fixed data.

There are no environment steps: `env_step` in rows and file names is the number
of updates, so that the files of all runs read alike.
"""

from lfgp_dmc.runs.rounds import Rounds
from lfgp_dmc.types import Metrics, SupervisedAgent


class EpochRounds(Rounds[SupervisedAgent]):
  """Trains until the agent converges, at most `schedule.env_steps` updates."""

  _unit, _label = "update", "training until validation stops improving"
  _has_known_end = False

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
