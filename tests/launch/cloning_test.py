"""BC runs from their config to their files, continued, and played."""

from unittest import mock

import numpy as np
from absl.testing import parameterized

import lfgp_dmc
from lfgp_dmc.agents.bc.agent import BcAgent
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.launch import policies
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.runs import run_folder
from tests import fixtures as shared
from tests.launch import fixtures


class CloningTest(fixtures.RunTest):
  def config(self, algorithm, **changes):
    small = {
      "agent.learning_rate": 3e-3,
      "agent.overfit_tolerance": 5,
      "env_steps": 2000,
      "evaluation_episodes": 1,
      "pairs_per_task": 40,
    }
    return super().config(algorithm=algorithm, **{**small, **changes})

  @parameterized.parameters("bc", "bc_less", "multitask_bc")
  def test_leaves_rows_a_checkpoint_and_a_policy(self, algorithm):
    run, progress = self.train(self.config(algorithm))
    self.assertTrue(progress.is_complete)
    rows = shared.rows(run / "metrics.csv")
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
    seen = np.zeros(2, np.float32)
    self.assertEqual(act(seen).shape, (2,))
    (last,) = policies.at_checkpoints(policies.find(str(run)), 1)
    acted = last.make().act(seen, tasks[-1])
    np.testing.assert_array_equal(acted, act(seen))
    stored = run_folder.read_config(run)["policy"]
    self.assertEqual(stored["env_step"], progress.update)

  def test_resumes_to_the_numbers_of_a_run_never_stopped(self):
    config = self.config("multitask_bc")
    self.check_resume(config, checkpoints=2)
    before = fixtures.numbers(self.folder / "runs" / "whole")
    whole, _ = self.train(config, "whole", resume=True)
    self.assertEqual(fixtures.numbers(whole), before)

  def test_loses_at_most_what_came_after_its_last_checkpoint(self):
    changes = {"agent.overfit_tolerance": 20, "env_steps": 150, "log_every": 7}
    config = self.config("bc", checkpoint_every=30, **changes)
    one, whole = self.train(config, "one")
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
      self.train(config, "other")
    other, resumed = self.train(config, "other", resume=True)
    self.assertEqual(resumed.update, whole.update)
    self.assertEqual(fixtures.numbers(other), fixtures.numbers(one))

  def test_clones_on_a_task_of_the_control_suite(self):
    dataset = fixtures.write_dataset(self.folder / "new", ("swingup",), 5, 1)
    config = self.config(
      "bc",
      demonstrations=str(dataset),
      environment="tests.launch.fixtures:load_cartpole",
      main_task="swingup",
      env_steps=100,
    )
    run, _ = self.train(config)
    (row,) = evaluation_csv.read_csv(run / "evaluation.csv")
    self.assertEqual((row.task, row.success), ("swingup", None))
    act = lfgp_dmc.load_policy(run)
    self.assertEqual(act(np.zeros(5, np.float32)).shape, (1,))

  def test_asks_for_demonstrations_of_the_main_task_alone(self):
    for pairs, message in (
      (50, "collect it: .* --task=lift --tasks=lift --pairs_per_task=50"),
      (0, "collect it by .*; the head of a flagfile says how"),
    ):
      config = self.config(
        "bc", demonstrations="no/where", environment="", main_task="lift",
        pairs_per_task=pairs,
      )  # fmt: skip
      with self.assertRaisesRegex(UserError, message):
        self.train(config)


class DacRunTest(fixtures.RunTest):
  def test_trains_the_main_task_alone(self):
    run, _ = self.train(self.config(algorithm="dac", env_steps=60))
    rows = evaluation_csv.read_csv(run / "evaluation.csv")
    self.assertEqual({row.task for row in rows}, {"right"})
    act = lfgp_dmc.load_policy(run)
    self.assertEqual(act(np.zeros(2, np.float32)).shape, (2,))
