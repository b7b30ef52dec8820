"""Figures of a study: which runs, which numbers, and what is said to lack."""

import json
import pathlib

import imageio.v2 as imageio
import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc.acting import evaluation
from lfgp_dmc.acting.evaluation import EvaluationRow
from lfgp_dmc.data import csv_files
from lfgp_dmc.study import aggregates, figures, run_results
from lfgp_dmc.task_names import MAIN_TASKS, task_set


def write_run(folder, algorithm, main_task, seed, scores, **config):
  """A run's folder with `env_step -> successes of 4 episodes`, all tasks."""
  path = pathlib.Path(folder) / f"{algorithm}_{main_task}_{seed}{len(config)}"
  path.mkdir(parents=True)
  config = {"algorithm": algorithm, "main_task": main_task, **config}
  (path / "config.json").write_text(json.dumps({"seed": seed, **config}))
  rows = [
    EvaluationRow(step, task, i, 0, int(i < count), None, 10.0 * count)
    for step, count in scores.items()
    for task in task_set(main_task)
    for i in range(4)
  ]
  evaluation.write_csv(path / "evaluation.csv", rows)
  return path


class AggregatesTest(absltest.TestCase):
  def test_mean_and_deviation_of_the_runs(self):
    scores = np.array([[[0.0, 1.0]], [[1.0, 1.0]]])
    found = aggregates.estimate(scores, "mean")
    np.testing.assert_allclose(found.middle, [0.5, 1.0])
    np.testing.assert_allclose(found.low, [0.0, 1.0])
    np.testing.assert_allclose(found.high, [1.0, 1.0])

  def test_the_interquartile_mean_leaves_the_tails_out(self):
    # 8 values: the lowest and the highest two are cut.
    scores = np.array([0, 0, 4, 4, 6, 6, 9, 99.0]).reshape(4, 2, 1)
    found = aggregates.estimate(scores, "iqm")
    np.testing.assert_allclose(found.middle, [5.0])
    self.assertLess(found.low[0], 5.0)
    self.assertGreater(found.high[0], 5.0)

  def test_the_bootstrap_draws_within_tasks_only(self):
    # Runs agree within each task, so every resample is the same.
    scores = np.tile(np.array([[0.0], [1.0]]), (5, 1, 1))
    self.assertEqual(scores.shape, (5, 2, 1))
    found = aggregates.estimate(scores, "iqm")
    np.testing.assert_allclose(found.low, found.high)

  def test_a_single_run_has_no_interval(self):
    found = aggregates.estimate(np.full((1, 1, 3), 0.25), "iqm")
    np.testing.assert_allclose(found, np.full((3, 3), 0.25))
    with self.assertRaisesRegex(ValueError, "valid: mean, iqm"):
      aggregates.estimate(np.zeros((1, 1, 1)), "median")


class StudyTest(parameterized.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)

  def _runs(self):
    return run_results.read_runs([self.folder])[0]

  def test_curves_keep_the_steps_that_all_seeds_have(self):
    write_run(self.folder, "lfgp", "stack", 0, {0: 0, 100: 2, 200: 4})
    write_run(self.folder, "lfgp", "stack", 1, {0: 1, 100: 4})
    runs = self._runs()
    curve = run_results.curve(runs, "reach")
    np.testing.assert_array_equal(curve.steps, [0, 100])
    np.testing.assert_allclose(curve.scores[:, 0], [[0, 0.5], [0.25, 1]])
    self.assertIn(
      "seed 0 to 200, seed 1 to 100", run_results.uneven(runs, "stack")
    )
    self.assertIsNone(run_results.curve(runs, "insert"))

  def test_behaviour_cloning_counts_by_its_last_evaluation(self):
    write_run(self.folder, "bc", "stack", 0, {500: 4, 1000: 2})
    write_run(self.folder, "bc", "stack", 1, {700: 1})
    curve = run_results.curve(self._runs(), "stack")
    np.testing.assert_allclose(curve.scores[:, 0], [[0.5], [0.25]])

  @parameterized.parameters(
    ("lfgp", {"demonstrations": "data/stack_reset"}),
    ("lfgp_play", {"demonstrations": "data/stack_play"}),
    ("lfgp_transfer", {"transfer_from": "runs/a"}),
    ("lfgp_transfer", {"agent": {"transfer_run": "runs/a"}}),
    ("lfgp", {"agent": {"transfer_run": "", "transfer_updates": 1000}}),
  )
  def test_the_method_follows_from_the_config(self, method, config):
    self.assertEqual(
      run_results.method_of({"algorithm": "lfgp", **config}), method
    )

  def test_two_runs_of_one_seed_are_refused(self):
    write_run(self.folder, "lfgp", "stack", 0, {0: 0})
    write_run(self.folder, "lfgp", "stack", 0, {0: 0}, demonstrations="data/a")
    with self.assertRaisesRegex(ValueError, "both lfgp on stack with seed 0"):
      self._runs()

  def test_a_run_without_evaluation_is_said(self):
    write_run(self.folder, "lfgp", "stack", 0, {0: 0})
    (self.folder / "lfgp_stack_00" / "evaluation.csv").unlink()
    runs, notes = run_results.read_runs([self.folder / "lfgp_stack_00"])
    self.assertEmpty(runs)
    self.assertRegex(notes[0], "nothing was evaluated yet")
    with self.assertRaisesRegex(ValueError, "no run for the figure 'main'"):
      figures.draw("main", runs, self.folder / "main.png")


class StudyFiguresTest(parameterized.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)

  @parameterized.parameters(
    ("main", "mean"),
    ("main", "iqm"),
    ("multitask", "mean"),
    ("return_play", "iqm"),
  )
  def test_draws_and_writes_its_numbers(self, name, kind):
    methods = {"lfgp": {}, "multitask_bc": {}, "bc_less": {},
               "lfgp_play": {"demonstrations": "a_play"}}  # fmt: skip
    for method, config in methods.items():
      for main_task in MAIN_TASKS[: 4 if method == "lfgp" else 2]:
        for seed in range(2):
          write_run(
            self.folder / method,
            method.removesuffix("_play"),
            main_task,
            seed,
            {100: seed, 200: 3},
            **config,
          )
    runs, _ = run_results.read_runs(
      [self.folder / method for method in methods]
    )
    path = self.folder / "figures" / "a.png"
    notes = figures.draw(name, runs, path, kind)
    picture = imageio.imread(path)
    self.assertGreater(picture.shape[1], 1500)
    self.assertGreater(np.ptp(picture[..., :3]), 200)
    columns, rows = csv_files.read(path.with_suffix(".csv"))
    self.assertEqual(columns, list(figures.COLUMNS))
    (last,) = [
      row
      for row in rows
      if row["method"] == "lfgp"
      and row["env_step"] == "200"
      and (row["main_task"], row["task"]) == ("bring", "bring")
    ]
    expected = 30.0 if name.startswith("return") else 0.75
    self.assertEqual(float(last["middle"]), expected)
    self.assertEqual(last["runs"], "2")
    has_all = any(row["main_task"] == "all" for row in rows)
    self.assertEqual(has_all, (name, kind) == ("main", "iqm"))
    if name == "main":
      self.assertIn("no runs of DAC on stack, unstack_stack, bring, insert",
                    notes)  # fmt: skip
      self.assertIn("no runs of Multitask BC on bring, insert", notes)

  def test_only_cloning_becomes_bars(self):
    for seed in range(3):
      write_run(self.folder, "bc", "stack", seed, {900: seed})
    runs, _ = run_results.read_runs([self.folder])
    path = self.folder / "bars.pdf"
    figures.draw("main", runs, path)
    self.assertTrue(path.read_bytes().startswith(b"%PDF"))
    (row,) = csv_files.read(path.with_suffix(".csv"))[1]
    self.assertEqual((row["env_step"], row["middle"]), ("", "0.25"))


if __name__ == "__main__":
  absltest.main()
