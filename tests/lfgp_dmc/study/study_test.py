"""Statistics and figures of a study, from runs written here."""

import json

import imageio.v2 as imageio
import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc.data import csv_files, evaluation_csv
from lfgp_dmc.study import figures, run_picture, run_results, statistics
from lfgp_dmc.task_names import MAIN_TASKS, task_set
from tests.fixtures import FolderTest


def _scores(*tasks):
  """Runs of each task -> [runs, tasks, 1]."""
  return np.array(tasks, float).T[..., None]


class StatisticsTest(absltest.TestCase):
  def test_mean_and_standard_deviation_of_the_runs(self):
    found = statistics.mean(np.array([[[0.0, 1.0]], [[1.0, 1.0]]]))
    np.testing.assert_allclose(found, [[0.5, 1.0], [0.0, 1.0], [1.0, 1.0]])

  def test_the_interquartile_mean_leaves_the_tails_out(self):
    # The lowest and the highest two of 8 are cut.
    found = statistics.interquartile_mean(_scores([0, 4, 6, 9], [0, 4, 6, 99]))
    np.testing.assert_allclose(found.middle, [5.0])

  def test_the_bootstrap_draws_within_tasks(self):
    # Resamples of the first task: (0, 0), (0, 1), (1, 0), (1, 1). Without the
    # lowest and the highest of the four, max(first) and a 5 are left.
    found = statistics.interquartile_mean(_scores([0, 1], [5, 5]))
    np.testing.assert_allclose(found, [[3.0], [2.5], [3.0]])

  def test_equal_runs_have_an_interval_of_no_height(self):
    for runs in range(2, 9):
      for score in (0.66, 0.1, 1 / 3):
        found = statistics.interquartile_mean(np.full((runs, 4, 1), score))
        self.assertBetween(found.middle[0], found.low[0], found.high[0])

  def test_a_single_run_has_no_interval(self):
    found = statistics.interquartile_mean(np.full((1, 1, 3), 0.25))
    np.testing.assert_allclose(found, np.full((3, 3), 0.25))

  def test_probability_of_improvement(self):
    # First task: 3 wins of 4 pairs; second: 4 ties.
    found = statistics.probability_of_improvement(
      _scores([1, 3], [1, 1]), _scores([2, 0], [1, 1])
    )
    # Resamples of the first task range from (1, 1) against (2, 2) to all wins.
    np.testing.assert_allclose(found, [[0.625], [0.25], [0.75]])
    better = statistics.probability_of_improvement(
      _scores([3, 4, 5]), _scores([1, 2])
    )
    np.testing.assert_allclose(better, [[1.0], [1.0], [1.0]])


class StudyTest(FolderTest):
  def _write(self, algorithm, main_task, seed, scores, **config):
    """A run with `env_step -> successes of 4 episodes`, alike in all tasks."""
    path = self.folder / f"{algorithm}_{main_task}_{seed}{len(config)}"
    path.mkdir()
    config |= {"algorithm": algorithm, "main_task": main_task, "seed": seed}
    (path / "config.json").write_text(json.dumps(config))
    rows = [
      evaluation_csv.EvaluationRow(
        step, task, i, 0, int(i < count), None, 10.0 * count
      )
      for step, count in scores.items()
      for task in task_set(main_task)
      for i in range(4)
    ]
    evaluation_csv.append_csv(path / "evaluation.csv", rows)

  def _read(self):
    return run_results.read_runs([self.folder])[0]

  def test_curves_keep_the_steps_that_all_seeds_have(self):
    self._write("lfgp", "stack", 0, {0: 0, 100: 2, 200: 4})
    self._write("lfgp", "stack", 1, {0: 1, 100: 4})
    runs = self._read()
    curve = run_results.curve([(runs, "reach")])
    np.testing.assert_array_equal(curve.steps, [0, 100])
    np.testing.assert_allclose(curve.scores[:, 0], [[0, 0.5], [0.25, 1]])
    both = run_results.curve([(runs, "reach"), (runs[:1], "stack")])
    self.assertLen(both.scores, 1)  # of the seed that both have
    (note,) = run_results.uneven(runs)
    self.assertIn("seed 0 to 200, seed 1 to 100", note)
    self.assertIsNone(run_results.curve([(runs, "insert")]))

  def test_behaviour_cloning_counts_by_its_last_evaluation(self):
    self._write("bc", "stack", 0, {500: 4, 1000: 2})
    self._write("bc", "stack", 1, {700: 1})
    curve = run_results.curve([(self._read(), "stack")])
    np.testing.assert_allclose(curve.scores[:, 0], [[0.5], [0.25]])
    self.assertEmpty(run_results.uneven(self._read()))
    self._write(
      "multitask_bc",
      "stack",
      0,
      {500: 4, 1000: 2},
      demonstrations="data/a_play",
    )
    (run,) = (run for run in self._read() if run.method == "multitask_bc_play")
    self.assertEqual(run_results.curve([([run], "stack")]).steps, [0])

  @parameterized.parameters(
    ("lfgp", {"demonstrations": "data/stack_reset", "transfer_from": ""}),
    ("lfgp", {"demonstrations": "play/display_reset"}),
    ("lfgp_play", {"demonstrations": "data/stack_play"}),
    ("lfgp_transfer", {"transfer_from": "runs/a"}),
  )
  def test_the_method_follows_from_the_config(self, method, config):
    found = run_results.method_of({"algorithm": "lfgp", **config})
    self.assertEqual(found, method)

  def test_two_runs_of_one_seed_are_refused(self):
    self._write("lfgp", "stack", 0, {0: 0})
    self._write("lfgp", "stack", 0, {0: 0}, demonstrations="data/a")
    with self.assertRaisesRegex(ValueError, "both lfgp on stack with seed 0"):
      self._read()

  def test_a_config_of_odd_types_is_named(self):
    self._write("lfgp", "stack", 0, {0: 0}, demonstrations=[1])
    self.assertLen(self._read(), 1)
    for seed in ("a", None, [1]):
      self._write("lfgp", "stack", seed, {0: 0})
      with self.assertRaisesRegex(ValueError, "config.json: seed is"):
        self._read()

  def test_a_config_that_says_not_of_what_is_named(self):
    (self.folder / "config.json").write_text('{"algorithm": 1}')
    for read in (
      lambda: self._read(),
      lambda: run_picture.draw(self.folder, self.folder / "a.png"),
    ):
      with self.assertRaisesRegex(
        ValueError, "config.json is of no run: it has no algorithm"
      ):
        read()

  def test_a_run_without_evaluation_is_noted(self):
    self._write("lfgp", "stack", 0, {})
    runs, notes = run_results.read_runs([self.folder / "lfgp_*"])
    self.assertEmpty(runs)
    self.assertRegex(notes[0], "nothing was evaluated yet")
    with self.assertRaisesRegex(ValueError, "no run for the figure 'main'"):
      figures.draw("main", runs, self.folder / "main.png")

  @parameterized.parameters(
    ("main", "success", "mean"),
    ("main", "success", "iqm"),
    ("multitask", "success", "mean"),
    ("play", "return", "iqm"),
  )
  def test_draws_and_writes_its_numbers(self, name, quantity, kind):
    play = {"demonstrations": "a_play"}
    for seed in range(2):
      for i, main_task in enumerate(MAIN_TASKS):
        scores = {100: seed, 200: 3}
        self._write("lfgp", main_task, seed, scores)
        if i < 2:
          self._write("multitask_bc", main_task, seed, scores)
          self._write("bc_less", main_task, seed, scores)
          self._write("lfgp", main_task, seed, scores, **play)
    path = self.folder / "figures" / "a.png"
    notes = figures.draw(name, self._read(), path, quantity, kind)
    picture = imageio.imread(path)
    self.assertGreater(picture.shape[1], 1500)
    self.assertGreater(np.ptp(picture[..., :3]), 200)
    columns, rows = csv_files.read(f"{path}.csv")
    self.assertEqual(columns, list(figures.COLUMNS))
    found = {tuple(row.values())[:4]: row for row in rows}
    last = found["bring", "bring", "lfgp", "200"]
    expected = 30.0 if quantity == "return" else 0.75
    self.assertEqual((float(last["middle"]), last["runs"]), (expected, "2"))
    has_all = any(row["main_task"] == "all" for row in rows)
    self.assertEqual(has_all, (name, kind) == ("main", "iqm"))
    if name == "main":
      lacking = f"no runs of DAC on {', '.join(MAIN_TASKS)}"
      self.assertIn(lacking, notes)
      self.assertIn("no runs of Multitask BC on bring, insert", notes)

  def test_all_four_are_of_the_seeds_that_each_has(self):
    for main_task in MAIN_TASKS:
      for seed in range(3 if main_task == "stack" else 2):
        self._write("lfgp", main_task, seed, {100: seed})
        self._write("dac", main_task, seed + 5 * len(main_task), {100: 1})
    path = self.folder / "a.png"
    notes = figures.draw("main", self._read(), path, kind="iqm")
    self.assertIn("all four of LfGP: 2 of 3 seeds", notes)
    self.assertIn("DAC has no seed and step in common of all tasks", notes)
    rows = csv_files.read(f"{path}.csv")[1]
    (row,) = (row for row in rows if row["main_task"] == "all")
    self.assertEqual((row["method"], row["runs"]), ("lfgp", "2"))

  def test_only_cloning_becomes_bars(self):
    for seed in range(3):
      self._write("bc", "stack", seed, {900: seed})
    path = self.folder / "bars.pdf"
    figures.draw("main", self._read(), path)
    self.assertTrue(path.read_bytes().startswith(b"%PDF"))
    (row,) = csv_files.read(f"{path}.csv")[1]
    self.assertEqual((row["env_step"], row["middle"]), ("", "0.25"))

  def test_learning_curves_of_one_run_and_of_several(self):
    for seed in range(2):
      self._write("lfgp", "stack", seed, {0: 0, 100: seed})
    runs = self._read()
    for some, quantity in ((runs[:1], "success"), (runs, "return")):
      path = self.folder / "figures" / f"{quantity}.png"
      self.assertEmpty(figures.learning_curve(some, path, quantity))
      self.assertGreater(np.ptp(imageio.imread(path)[..., :3]), 200)

  def test_an_environment_that_reports_no_success_has_no_curve_of_it(self):
    row = evaluation_csv.EvaluationRow(0, "swing", 0, 0, None, None, 1.0)
    run = run_results.Run("dac", "swing", 0, self.folder, [row])
    with self.assertRaisesRegex(ValueError, "no success in the evaluations of"):
      figures.learning_curve([run], self.folder / "a.png")
