"""The loop without an environment, with a toy agent."""

import os
import signal

from lfgp_dmc.data import csv_files
from lfgp_dmc.runs import supervised
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.schedule import Progress, TrainSchedule
from tests import fixtures


class _Agent(fixtures.ToyAgent):
  """Counts; epochs have ten updates."""

  def __init__(self, converges_after=None, on_update=None):
    super().__init__()
    self.epochs = 0
    self._converges_after = converges_after
    self._on_update = on_update

  @property
  def has_converged(self):
    return self.epochs == self._converges_after

  def begin_epoch(self):
    return 10

  def update(self):
    super().update()
    if self._on_update:
      self._on_update(self.updates)

  def end_epoch(self):
    self.epochs += 1

  def metrics(self):
    return {"epoch": float(self.epochs), "loss/train": 1.0 / self.updates}


class SupervisedTest(fixtures.FolderTest):
  def setUp(self):
    super().setUp()
    self._evaluated, self._saved = [], []

  def _train(self, agent, progress=None, **schedule):
    options = {
      "env_steps": 100,
      "log_every": 25,
      "evaluate_every": 45,
      "checkpoint_every": 35,
      "progress_bar": False,
    } | schedule
    schedule, log = TrainSchedule(**options), MetricsLog(self.folder)
    return supervised.EpochRounds(agent, schedule, log, progress).run(
      lambda step: self._evaluated.append(step) or {"right": 0.5},
      lambda at: self._saved.append((at.env_step, at.is_complete)),
    )

  def _steps(self):
    rows = csv_files.read(self.folder / "metrics.csv")[1]
    return [int(row["env_step"]) for row in rows]

  def test_everything_happens_when_due(self):
    agent = _Agent()
    progress = self._train(agent)
    self.assertEqual((progress.update, progress.env_step), (100, 100))
    self.assertTrue(progress.is_complete)
    self.assertEqual((agent.updates, agent.epochs), (100, 10))
    self.assertEqual(self._steps(), [25, 50, 75, 100])
    self.assertEqual(self._evaluated, [50, 90, 100])  # at epochs' ends
    self.assertEqual(self._saved, [(40, False), (70, False), (100, True)])

  def test_convergence_ends_it_with_a_row_and_a_checkpoint(self):
    progress = self._train(_Agent(converges_after=3))
    self.assertTrue(progress.is_complete)
    self.assertEqual(self._steps(), [25, 30])
    self.assertEqual(self._evaluated, [30])
    self.assertEqual(self._saved, [(30, True)])

  def test_the_most_updates_cut_an_epoch(self):
    agent = _Agent()
    self.assertEqual(self._train(agent, env_steps=33).update, 33)
    self.assertEqual((agent.updates, agent.epochs), (33, 4))
    self.assertEqual(self._steps()[-1], 33)

  def test_a_signal_finishes_the_epoch_and_resume_goes_on(self):
    agent = _Agent(
      on_update=lambda n: n == 12 and os.kill(os.getpid(), signal.SIGTERM)
    )
    with self.assertLogs(level="WARNING"):
      progress = self._train(agent)
    self.assertEqual(self._saved, [(20, False)])
    self.assertFalse(progress.is_complete)
    self.assertEqual(self._evaluated, [])
    self._train(agent, progress=progress)
    self.assertEqual(agent.updates, 100)
    self.assertEqual(self._saved[-1], (100, True))

  def test_a_finished_run_is_left_alone(self):
    progress = Progress(env_step=30, update=30, is_complete=True)
    self.assertEqual(self._train(_Agent(), progress=progress).update, 30)
    self.assertEqual((self._evaluated, self._saved), ([], []))

  def test_may_evaluate_first(self):
    self._train(_Agent(converges_after=1), evaluate_first=True)
    self.assertEqual(self._evaluated, [0, 10])
