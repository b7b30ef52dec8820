"""Evaluation: the same rows whatever the workers, and its files."""

import functools
import os
from unittest import mock

import dm_env
import numpy as np
from absl.testing import absltest

from lfgp_dmc import toy
from lfgp_dmc.acting import environments, evaluation
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from tests.fixtures import FolderTest

_ROWS = [
  EvaluationRow(1000, "right", 0, 7, 1, 4, 2.5),
  EvaluationRow(1000, "right", 1, 7, 0, None, 0.1),
  EvaluationRow(1000, "left", 0, 7, None, None, -3.0),
]


class _Seeded(toy.PointEnvironment):
  """An environment that is seeded when built, as most are."""

  reseed = property()  # hasattr says no


class _Steady(toy.WalkingActor):
  """Walks alike in every episode."""

  def begin(self, task, seed):
    super().begin(task, 0)


def _evaluate(make=toy.PointEnvironment, **options):
  return evaluation.evaluate(
    make,
    options.pop("make_actor", toy.WalkingActor),
    options.pop("tasks", toy.TASKS),
    episodes=3,
    seed=options.pop("seed", 7),
    progress=False,
    **options,
  )


class EvaluateTest(absltest.TestCase):
  def test_one_row_an_episode_task_by_task(self):
    rows = _evaluate(env_step=360)
    self.assertEqual(
      [(row.task, row.episode) for row in rows],
      [(task, i) for task in toy.TASKS for i in range(3)],
    )
    for row in rows:
      self.assertEqual((row.env_step, row.seed, row.success), (360, 7, 1))
      self.assertBetween(row.steps_to_success, 2, 6)
      self.assertLess(row.episode_return, 20)  # all 20 steps, at most 1 each
      self.assertGreater(row.episode_return, 12)

  def test_workers_change_nothing(self):
    before = dict(os.environ)
    self.assertEqual(_evaluate(workers=2), _evaluate(workers=1))
    self.assertEqual(dict(os.environ), before)

  def test_an_episode_depends_on_seed_and_number_alone(self):
    both, left = _evaluate(), _evaluate(tasks=("left",))
    self.assertEqual(both[3:], left)

  def test_resets_are_the_same_for_every_task(self):
    environment = toy.PointEnvironment()
    with mock.patch.object(
      environment, "reseed", wraps=environment.reseed
    ) as reseed:
      _evaluate(lambda: environment)
    seeds = [call.args[0] for call in reseed.call_args_list]
    self.assertEqual(seeds[:3], seeds[3:])
    self.assertLen(set(seeds), 3)

  def test_steps_to_success_count_the_step_that_succeeds(self):
    class Near(toy.PointEnvironment):
      def reset(self):
        super().reset()
        self._position = np.array([0.45, 0.0])
        return dm_env.restart(self._observe())

    (row, *_) = _evaluate(Near, tasks=("right",))
    self.assertEqual(row.steps_to_success, 1)

  def test_resets_follow_the_seed(self):
    returns = [
      [row.episode_return for row in _evaluate(make_actor=_Steady, seed=seed)]
      for seed in (7, 8)
    ]
    self.assertNotEqual(*returns)

  def test_environments_without_reseed_are_built_anew(self):
    rows = _evaluate(_Seeded)
    self.assertEqual(rows, _evaluate(_Seeded))
    self.assertLen({row.episode_return for row in rows}, 6)

  def test_a_physics_failure_is_a_failed_episode(self):
    make = functools.partial(toy.PointEnvironment, fail_every=2)
    with self.assertLogs(level="WARNING"):
      rows = _evaluate(make, tasks=("right",))
    self.assertEqual([row.success for row in rows], [1, 0, 1])
    self.assertIsNone(rows[1].steps_to_success)
    with self.assertNoLogs(level="WARNING"):  # any end, as nothing says success
      rows = _evaluate(make, tasks=("swing",))
    self.assertEqual([row.success for row in rows], [None] * 3)


class FilesTest(FolderTest):
  def test_round_trip_and_append(self):
    path = self.folder / "evaluation.csv"
    evaluation_csv.append_csv(path, _ROWS)
    evaluation_csv.append_csv(path, _ROWS[:1])
    self.assertEqual(evaluation_csv.read_csv(path), [*_ROWS, _ROWS[0]])
    lines = path.read_text().splitlines()
    self.assertEqual(
      lines[0], "env_step,task,episode,seed,success,steps_to_success,return"
    )
    self.assertEqual(lines[2], "1000,right,1,7,0,,0.1")
    path.write_text("\ufeff" + path.read_text())  # as spreadsheets do
    evaluation_csv.append_csv(path, _ROWS[:1])
    self.assertLen(evaluation_csv.read_csv(path), len(_ROWS) + 2)

  def test_another_csv_is_refused(self):
    path = self.folder / "a.csv"
    path.write_text("env_step\n1\n")
    with self.assertRaisesRegex(ValueError, "a.csv is no evaluation"):
      evaluation_csv.read_csv(path)

  def test_the_newest_evaluation_is_that_of_the_latest_step(self):
    steps = (1000, 3000, 2000, 3000)
    rows = [_ROWS[0]._replace(env_step=step) for step in steps]
    newest = evaluation_csv.newest(rows)
    self.assertEqual([row.env_step for row in newest], [3000, 3000])
    self.assertEmpty(evaluation_csv.newest([]))

  def test_table(self):
    lines = evaluation_csv.success_table(_ROWS).splitlines()
    self.assertEqual(lines[1].split(), ["right", "50.0%", "2", "4.0", "1.30"])
    self.assertEqual(lines[2].split(), ["left", "-", "1", "-", "-3.00"])
    self.assertEqual(evaluation_csv.success_rates(_ROWS)["right"], 0.5)


class EnvironmentsTest(absltest.TestCase):
  def test_widths_leave_task_observables_out(self):
    self.assertEqual(environments.widths(toy.PointEnvironment()), (2, 2))

  def test_rewards_by_task_or_the_environments_own(self):
    environment = toy.PointEnvironment()
    environment.reset()
    timestep = environment.step(np.zeros(2))
    rewards = environments.task_rewards(timestep, ("right", "left", "other"))
    self.assertEqual(rewards[2], rewards[0])
    self.assertAlmostEqual(float(rewards[0] + rewards[1]), 0.4, places=5)
