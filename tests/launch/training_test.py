"""A run from its config to its files, continued, and refused."""

import pathlib
import signal
from unittest import mock

import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc
from launch import training
from launch.command import UserError
from lfgp_dmc import csv_files, evaluation, loop, run_folder
from tests.launch import fixtures

_RATES = ("wall_s", "steps_per_s", "updates_per_s")


def _rows(path: pathlib.Path) -> list[dict[str, str]]:
  _, rows = csv_files.read(path)
  return [{k: v for k, v in row.items() if k not in _RATES} for row in rows]


class TrainingTest(parameterized.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)
    self.dataset = fixtures.write_dataset(self.folder / "data")
    self.run = self.folder / "runs" / "a"

  def _config(self, **changes):
    return fixtures.small_config(self.dataset, **changes)

  def _train(self, config, path=None, resume=False):
    return training.train(config, path or self.run, resume, False)

  def test_leaves_rows_checkpoints_and_a_policy(self):
    progress = self._train(self._config(evaluate_first=True))
    self.assertEqual(progress.env_step, 200)
    self.assertLen(_rows(self.run / "metrics.csv"), 10)
    rows = evaluation.read_csv(self.run / "evaluation.csv")
    self.assertEqual({row.env_step for row in rows}, {0, 100, 200})
    self.assertEqual({row.task for row in rows}, {"right", "left"})
    self.assertTrue((self.run / "checkpoints" / "000000200").is_dir())
    act = lfgp_dmc.load_policy(self.run, "left")
    self.assertEqual(act(np.zeros(2, np.float32)).shape, (2,))
    stored = run_folder.read_config(self.run)
    self.assertEqual(stored["policy"]["env_step"], 200)

  @parameterized.parameters(False, True)
  def test_resumes_to_the_numbers_of_a_run_never_stopped(self, actor_process):
    config = self._config(actor_process=actor_process)
    self._train(config)
    other = self.folder / "runs" / "b"
    real, calls = training._Run._checkpoint, []

    def stop_after_two(run, progress):
      real(run, progress)
      calls.append(progress.env_step)
      if len(calls) == 2:
        signal.raise_signal(signal.SIGTERM)

    with mock.patch.object(training._Run, "_checkpoint", stop_after_two):
      progress = self._train(config, other)
    self.assertLess(progress.env_step, 200)
    progress = self._train(config, other, resume=True)
    self.assertEqual(progress.env_step, 200)
    for name in ("metrics.csv", "evaluation.csv"):
      self.assertEqual(_rows(other / name), _rows(self.run / name))

  def test_a_finished_run_resumes_to_nothing(self):
    self._train(self._config())
    before = (self.run / "metrics.csv").read_bytes()
    progress = self._train(self._config(), resume=True)
    self.assertEqual(progress.env_step, 200)
    self.assertEqual((self.run / "metrics.csv").read_bytes(), before)

  def test_another_config_is_not_resumed(self):
    self._train(self._config())
    changed = self._config(**{"agent.xi": 10, "seed": 4})
    with self.assertRaisesRegex(
      UserError, r"seed \(0, now 4\); agent.xi \(5, now 10\)"
    ):
      self._train(changed, resume=True)

  def test_an_existing_folder_is_refused(self):
    self.run.mkdir(parents=True)
    with self.assertRaisesRegex(UserError, "exists.*--resume"):
      self._train(self._config())
    self.assertEmpty(list(self.run.iterdir()))

  @parameterized.parameters(
    ({"demonstrations": ""}, "demonstrations is not set"),
    ({"demonstrations": "no/where"}, "no dataset folder no/where"),
    ({"environment": "lfgp_dmc.toy:Nothing"}, "has no attribute 'Nothing'"),
    ({"environment": "nothing.at:all"}, "No module named 'nothing'"),
    ({"device": "abacus"}, "config.device is 'abacus'"),
    ({"pairs_per_task": 61}, r"fewer pairs of right \(60\), left \(60\)"),
    (
      {"attempts_per_task": 61},
      r"is 61; .* has fewer whole attempts of right \(\d+\), left \(\d+\)",
    ),
    ({"main_task": "up"}, "up.hdf5: missing"),
    (
      {"agent.scheduler": "weighted_random_handcrafted"},
      "handcrafted",
    ),
  )
  def test_bad_input_leaves_no_folder(self, changes, message):
    with self.assertRaisesRegex(UserError, message):
      self._train(self._config(**changes))
    self.assertFalse(self.run.exists())

  def test_every_fault_of_a_dataset_is_told(self):
    (self.dataset / "right.hdf5").write_bytes(b"not HDF5")
    (self.dataset / "left.hdf5").unlink()
    with self.assertRaisesRegex(
      UserError, r"(?s)right.hdf5: not a readable.*left.hdf5: missing"
    ):
      self._train(self._config())

  def test_demonstrations_of_another_rate_are_refused(self):
    folder = pathlib.Path(self.create_tempdir().full_path) / "lift"
    fixtures.write_dataset(folder, ("lift",), 59, 4)
    config = self._config(
      demonstrations=str(folder),
      environment="",
      main_task="lift",
      control_hz=5,
      **{"agent.episode_steps": 90},
    )
    with self.assertRaisesRegex(
      UserError, r"config.control_hz is 5; .* another rate: lift \(20\)"
    ):
      self._train(config)

  def test_uses_the_first_pairs_alone(self):
    with mock.patch.object(loop, "train") as train:
      train.return_value = loop.Progress()
      self._train(self._config(pairs_per_task=20))
    agent = train.call_args.args[1]
    self.assertEqual(agent._experts._sizes.tolist(), [20, 20])

  def test_uses_the_first_attempts_alone(self):
    with mock.patch.object(loop, "train") as train:
      train.return_value = loop.Progress()
      self._train(self._config(attempts_per_task=2))
    agent = train.call_args.args[1]
    self.assertEqual(agent._experts._final_sizes.tolist(), [2, 2])

  def test_a_smaller_replay_resumes_too(self):
    config = self._config(replay_capacity=60, env_steps=120)
    self._train(config)
    self._train(config, resume=True)


if __name__ == "__main__":
  absltest.main()
