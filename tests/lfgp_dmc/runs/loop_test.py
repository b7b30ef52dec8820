"""The training loop on the toy world with a toy agent."""

import dataclasses
import os
import signal
from unittest import mock

import numpy as np
from absl.testing import parameterized

from lfgp_dmc import signals, toy
from lfgp_dmc.acting import workers
from lfgp_dmc.data import csv_files
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs import loop
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.schedule import Progress, TrainSchedule
from tests import fixtures


class _Agent(fixtures.ToyAgent):
  """Remembers the calls, and in which order they come."""

  def __init__(self, on_act=None):
    super().__init__()
    self.prepared = self.begun = 0
    self.episodes = []
    self.on_act = on_act

  def prepare(self, progress_bar):
    assert not self.begun
    self.prepared += 1

  def begin_episode(self):
    assert self.prepared == 1
    self.begun += 1

  def act(self, observation):
    assert observation.shape == (2,) and observation.dtype == np.float32
    if self.on_act:
      self.on_act()
    return super().act(observation)

  def end_episode(self, episode):
    self.episodes.append(episode)


class LoopTest(fixtures.FolderTest, parameterized.TestCase):
  def setUp(self):
    super().setUp()
    self._evaluated, self._saved = [], []
    self._on_evaluation = None

  def _train(self, agent, environment=None, progress=None, **schedule):
    options = {
      "env_steps": 100,
      "log_every": 25,
      "evaluate_every": 50,
      "checkpoint_every": 30,
      "warmup_steps": 10,
      "progress_bar": False,
    } | schedule
    self._replay = Replay(1000, 2, 2, reward_tasks=toy.TASKS)
    rounds = loop.EpisodeRounds(
      environment or toy.PointEnvironment(),
      agent,
      self._replay,
      TrainSchedule(**options),
      MetricsLog(self.folder),
      progress,
    )
    return rounds.run(
      self._evaluate,
      lambda at: self._saved.append((at.env_step, at.update)),
    )

  def _evaluate(self, step):
    self._evaluated.append(step)
    if self._on_evaluation:
      self._on_evaluation()
    return {"right": 0.5}

  def _rows(self):
    return csv_files.read(self.folder / "metrics.csv")[1]

  def test_everything_happens_when_due(self):
    agent = _Agent()
    progress = self._train(agent)
    self.assertEqual(progress.env_step, 100)
    self.assertEqual(progress.update, 91)  # from the tenth transition on
    self.assertEqual((agent.begun, len(agent.episodes)), (5, 5))
    self.assertEqual(agent.episodes[0].observation.shape, (20, 2))
    self.assertEqual(agent.episodes[0].rewards.shape, (20, 2))
    self.assertEqual(self._evaluated, [60, 100])  # at episode ends
    self.assertEqual([s for s, _ in self._saved], [40, 60, 100])
    rows = self._rows()
    self.assertEqual(
      [row["env_step"] for row in rows], ["25", "50", "75", "100"]
    )
    self.assertEqual(rows[-1]["update"], "91")
    self.assertEqual(rows[-1]["replay_size"], "100")
    self.assertIn("steps_per_s", rows[0])

  def test_the_replay_holds_what_happened(self):
    agent = _Agent()
    self._train(agent)
    rows = self._replay.gather(np.arange(100))
    np.testing.assert_array_equal(
      rows.observation[20:40], agent.episodes[1].observation
    )
    np.testing.assert_array_equal(
      rows.next_observation[20:39], rows.observation[21:40]
    )
    distance = np.abs(rows.next_observation[:, 0] - 0.8)
    np.testing.assert_allclose(
      self._replay.gather_rewards(np.arange(100))[:, 0], 1 - distance, atol=1e-6
    )

  def test_a_run_ends_on_its_exact_step(self):
    progress = self._train(_Agent(), env_steps=33, evaluate_first=True)
    self.assertEqual(progress.env_step, 33)
    self.assertEqual(self._evaluated, [0, 33])
    self.assertEqual(self._saved[-1][0], 33)
    self.assertEqual(self._rows()[-1]["env_step"], "33")
    self.assertLen(self._replay, 33)

  def test_physics_failures_are_dropped(self):
    agent = _Agent()
    environment = toy.PointEnvironment(fail_every=2)
    with (
      self.assertLogs(level="WARNING"),
      mock.patch.object(
        environment, "reseed", wraps=environment.reseed
      ) as reseed,
    ):
      progress = self._train(agent, environment, env_steps=60)
    # Another start each, also after a failure.
    self.assertLen({call.args[0] for call in reseed.call_args_list}, 4)
    # 20 good, 10 dropped, 20 good, 10 dropped.
    self.assertEqual((progress.episodes, progress.physics_failures), (2, 2))
    self.assertLen(self._replay, 40)
    self.assertLen(agent.episodes, 2)
    kept = self._replay.gather(np.arange(40)).observation
    np.testing.assert_array_equal(kept[20:], agent.episodes[1].observation)
    self.assertEqual(self._rows()[-1]["physics_failures"], "2")

  def test_updates_in_another_ratio(self):
    self.assertEqual(
      self._train(_Agent(), warmup_steps=0, updates_per_step=0.25).update, 25
    )

  def test_random_steps_draw_wide_actions(self):
    self._train(_Agent(), random_steps=40)
    actions = np.abs(self._replay.gather(np.arange(100)).action)
    self.assertGreater(actions[:40].max(), 0.9)
    self.assertLessEqual(actions[40:].max(), 0.5)

  def test_a_signal_finishes_the_episode_and_resume_goes_on(self):
    agent = _Agent()
    agent.on_act = lambda: (
      os.kill(os.getpid(), signal.SIGTERM)
      if agent.begun == 2 and agent.updates == 15
      else None
    )
    with self.assertLogs(level="WARNING"):
      progress = self._train(agent, checkpoint_every=1000)
    self.assertEqual(progress.env_step, 40)
    self.assertEqual([step for step, _ in self._saved], [40])
    self.assertEqual(signal.getsignal(signal.SIGTERM), signal.SIG_DFL)
    progress = self._train(_Agent(), progress=progress, checkpoint_every=1000)
    self.assertEqual((progress.env_step, progress.episodes), (100, 5))
    self.assertEqual([step for step, _ in self._saved], [40, 100])

  def test_a_repeat_is_the_same_request_and_a_later_signal_is_not(self):
    with signals.stop_request() as stop, self.assertLogs(level="WARNING"):
      for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.raise_signal(number)
      self.assertTrue(stop)
      with (
        mock.patch.object(signals, "_REPEAT", 0.0),
        self.assertRaises(KeyboardInterrupt),
      ):
        signal.raise_signal(signal.SIGTERM)

  def test_nohup_holds(self):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    self.addCleanup(signal.signal, signal.SIGHUP, before)
    with signals.stop_request() as stop:
      signal.raise_signal(signal.SIGHUP)
    self.assertFalse(stop)

  @parameterized.parameters(0, 60, 100)
  def test_a_stop_in_an_evaluation_leaves_it_to_the_resumed_run(self, at):
    def stop_once():
      if self._evaluated[-1] == at:
        self._on_evaluation = None
        signal.raise_signal(signal.SIGTERM)

    schedule = {"evaluate_first": True, "checkpoint_every": 1000}
    self._on_evaluation = stop_once
    with self.assertLogs(level="WARNING"):
      progress = self._train(_Agent(), **schedule)
    self.assertEqual(self._saved[-1][0], at)
    self.assertTrue(progress.evaluation_due)
    self.assertFalse(progress.is_complete)
    self.assertEqual(self._evaluated[-1], at)
    progress = self._train(_Agent(), progress=progress, **schedule)
    self.assertTrue(progress.is_complete)
    self.assertEqual(self._saved[-1][0], 100)
    self.assertEqual(self._evaluated, sorted([0, 60, 100, at]))

  def test_a_lost_worker_leads_to_a_checkpoint_and_is_reported(self):
    def lose():
      raise workers.LostWorkerError("killed")

    self._on_evaluation = lose
    with self.assertRaisesRegex(workers.LostWorkerError, "killed"):
      self._train(_Agent(), checkpoint_every=1000)
    self.assertEqual([step for step, _ in self._saved], [60])

  def test_a_lost_worker_after_a_stop_is_no_fault(self):
    def stop_and_lose():
      signal.raise_signal(signal.SIGTERM)
      raise workers.LostWorkerError("killed")

    self._on_evaluation = stop_and_lose
    with self.assertLogs(level="WARNING"):
      progress = self._train(_Agent(), checkpoint_every=1000)
    self.assertEqual([step for step, _ in self._saved], [60])
    self.assertTrue(progress.evaluation_due)

  def test_a_stop_before_the_first_step_says_that_nothing_is_stored(self):
    agent = _Agent()

    def prepare(progress_bar):
      signal.raise_signal(signal.SIGINT)

    agent.prepare = prepare
    with self.assertLogs(level="WARNING") as logs:
      progress = self._train(agent, evaluate_first=True)
    self.assertIn("nothing is stored", logs.output[-1])
    self.assertEqual((progress.env_step, self._saved), (0, []))
    self.assertEqual(self._evaluated, [])

  def test_a_longer_run_does_not_begin_with_the_episode_that_was_cut(self):
    agent = _Agent()
    progress = self._train(agent, env_steps=50, random_steps=90)
    cut = self._replay.gather(np.arange(40, 50))
    longer = dataclasses.replace(progress, is_complete=False)
    progress = self._train(_Agent(), progress=longer, random_steps=90)
    self.assertEqual(progress.episodes, 4)
    after = self._replay.gather(np.arange(10))
    self.assertFalse(np.array_equal(cut.action, after.action))

  def test_a_resumed_run_goes_on_counting_its_seconds(self):
    progress = self._train(_Agent(), progress=Progress(60, wall_s=1000.0))
    self.assertBetween(progress.wall_s, 1000, 1100)
    for row in self._rows():
      self.assertBetween(float(row["wall_s"]), 1000, 1100)

  def test_a_finished_run_is_left_alone(self):
    self._train(_Agent(), progress=Progress(env_step=100))
    self.assertEqual((self._evaluated, self._saved), ([], []))

  def test_a_bad_schedule_names_its_field(self):
    with self.assertRaisesRegex(ValueError, "log_every is 0"):
      TrainSchedule(env_steps=1, log_every=0)
