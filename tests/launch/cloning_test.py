"""BC runs from their config to their files, continued, and played."""

import pathlib
from unittest import mock

import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc
from lfgp_dmc.agents.bc import BcAgent
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.launch import configs, training
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.runs import run_folder
from tests.launch import fixtures


def _config(dataset, algorithm, **changes):
  config = configs.make_config(algorithm)
  small = {
    "agent.batch_size": 8,
    "agent.networks.hidden_size": 16,
    "agent.learning_rate": 3e-3,
    "agent.overfit_tolerance": 5,
    "checkpoint_every": 40,
    "demonstrations": str(dataset),
    "deterministic": True,
    "device": "cpu",
    "env_steps": 2000,
    "environment": fixtures.POINT,
    "evaluate_every": 100,
    "evaluation_episodes": 1,
    "evaluation_workers": 1,
    "log_every": 20,
    "main_task": "right",
    "pairs_per_task": 40,
  }
  config.update_from_flattened_dict({**small, **changes})
  return configs.to_run_config(config)


class CloningTest(parameterized.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)
    self.dataset = fixtures.write_dataset(self.folder / "data")

  @parameterized.parameters("bc", "bc_less", "multitask_bc")
  def test_leaves_rows_a_checkpoint_and_a_policy(self, algorithm):
    run = self.folder / "runs" / algorithm
    config = _config(self.dataset, algorithm)
    progress = training.train(config, run, progress_bar=False)
    self.assertTrue(progress.is_complete)
    rows = fixtures.rows(run / "metrics.csv")
    last = rows[-1]
    self.assertEqual(int(last["env_step"]), progress.update)
    self.assertEqual(float(last["epoch"]) - float(last["best_epoch"]), 5)
    self.assertLess(float(last["loss/train"]), float(rows[0]["loss/train"]))
    best = min(float(row["loss/validation"]) for row in rows)
    self.assertLessEqual(float(last["loss/best_validation"]), best)
    tasks = ("right", "left") if algorithm == "multitask_bc" else ("right",)
    evaluated = evaluation_csv.read_csv(run / "evaluation.csv")
    self.assertEqual({row.task for row in evaluated}, set(tasks))
    self.assertEqual(evaluated[-1].env_step, progress.update)
    self.assertFalse((run / "replay").exists())
    act = lfgp_dmc.load_policy(run, tasks[-1])
    self.assertEqual(act(np.zeros(2, np.float32)).shape, (2,))
    stored = run_folder.read_config(run)["policy"]
    self.assertEqual(stored["env_step"], progress.update)

  def test_resumes_to_the_numbers_of_a_run_never_stopped(self):
    config = _config(self.dataset, "multitask_bc")
    one, other = self.folder / "one", self.folder / "other"
    whole = training.train(config, one, progress_bar=False)
    with fixtures.stopped_after(2):
      stopped = training.train(config, other, progress_bar=False)
    self.assertFalse(stopped.is_complete)
    # What a kill after a later row would leave, too.
    with open(other / "metrics.csv", "a", encoding="utf-8") as file:
      file.write("9999,9999")
    resumed = training.train(config, other, resume=True, progress_bar=False)
    self.assertEqual(resumed.update, whole.update)
    self.assertEqual(fixtures.numbers(other), fixtures.numbers(one))
    policies = [
      (run / "policy.safetensors").read_bytes() for run in (one, other)
    ]
    self.assertEqual(*policies)
    again = training.train(config, one, resume=True, progress_bar=False)
    self.assertEqual(again.update, whole.update)

  def test_loses_at_most_what_came_after_its_last_checkpoint(self):
    changes = {"agent.overfit_tolerance": 20, "log_every": 7}
    config = _config(self.dataset, "bc", checkpoint_every=30, **changes)
    one, other = self.folder / "one", self.folder / "other"
    whole = training.train(config, one, progress_bar=False)
    real, updates = BcAgent.update, []

    def die_in_an_epoch(agent):
      updates.append(1)
      if len(updates) == 59:  # as if killed: no handler runs, nothing is saved
        raise KeyboardInterrupt
      real(agent)

    with (
      mock.patch.object(BcAgent, "update", die_in_an_epoch),
      self.assertRaises(KeyboardInterrupt),
    ):
      training.train(config, other, progress_bar=False)
    resumed = training.train(config, other, resume=True, progress_bar=False)
    self.assertEqual(resumed.update, whole.update)
    self.assertEqual(fixtures.numbers(other), fixtures.numbers(one))

  def test_less_data_is_the_algorithms_own_default(self):
    self.assertEqual(configs.make_config("bc_less").pairs_per_task, 9000)
    self.assertEqual(configs.make_config("bc").pairs_per_task, 0)


class OtherWorldsTest(absltest.TestCase):
  def test_clones_on_a_task_of_the_control_suite(self):
    folder = pathlib.Path(self.create_tempdir().full_path)
    dataset = fixtures.write_dataset(folder / "data", ("swingup",), 5, 1)
    config = _config(
      dataset,
      "bc",
      environment="tests.launch.fixtures:load_cartpole",
      main_task="swingup",
      env_steps=100,
    )
    training.train(config, folder / "run", progress_bar=False)
    (row,) = evaluation_csv.read_csv(folder / "run" / "evaluation.csv")
    self.assertEqual((row.task, row.success), ("swingup", None))
    act = lfgp_dmc.load_policy(folder / "run")
    self.assertEqual(act(np.zeros(5, np.float32)).shape, (1,))


class DatasetHintTest(absltest.TestCase):
  def test_asks_for_the_main_task_alone(self):
    config = _config(pathlib.Path("no/where"), "bc")
    with self.assertRaisesRegex(
      UserError, "--task=right --tasks=right --pairs_per_task"
    ):
      training.train(config, pathlib.Path("never"), progress_bar=False)


class DacRunTest(absltest.TestCase):
  def test_trains_the_main_task_alone(self):
    folder = pathlib.Path(self.create_tempdir().full_path)
    dataset = fixtures.write_dataset(folder / "data")
    config = fixtures.small_config(
      dataset,
      **{
        "algorithm": "dac",
        "env_steps": 60,
      },
    )
    training.train(config, folder / "run", progress_bar=False)
    rows = evaluation_csv.read_csv(folder / "run" / "evaluation.csv")
    self.assertEqual({row.task for row in rows}, {"right"})
    act = lfgp_dmc.load_policy(folder / "run")
    self.assertEqual(act(np.zeros(2, np.float32)).shape, (2,))


if __name__ == "__main__":
  absltest.main()
