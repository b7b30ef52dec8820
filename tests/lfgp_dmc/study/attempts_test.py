"""Success against numbers of attempts, from CSV files written here."""

from unittest import mock

import imageio.v2 as imageio
import numpy as np
from absl.testing import parameterized

from lfgp_dmc.study import attempt_figures, attempts, drawing
from tests.fixtures import FolderTest

_HEADER = (
  "method,main_task,attempts,seed,start,success,clone_success,core_hours"
)
# All main tasks have seeds 0 and 1 of "lfgp from clone": 0.2, 0.4, 0.6, 0.8.
_ROWS = (
  "lfgp,stack,10,0,clone,0.2,0.1,2",
  "lfgp,stack,10,1,clone,0.4,,3",
  "lfgp,bring,10,0,clone,0.6,,2",
  "lfgp,bring,10,1,clone,0.8,,3",
  "lfgp,bring,10,2,clone,1.0,,5",
  "bc,stack,10,0,,0.4,,",
  "bc,stack,10,1,,0.4,,",
  "bc,bring,10,0,,0.1,,",
  "bc,bring,10,1,,0.1,,",
  "bc,stack,5,0,,0.0,,",
)


class AttemptsTest(FolderTest):
  def _read(self, *rows, header=_HEADER):
    path = self.folder / "a.csv"
    path.write_text("\n".join((header, *rows, "")))
    return attempts.read(path)

  def _points(self, baseline=""):
    points = attempts.summary(self._read(*_ROWS), baseline)
    return points, {point[:3]: point for point in points}

  def test_interquartile_means_of_tasks_and_of_all(self):
    points, by_key = self._points()
    self.assertLen(by_key, 8)
    self.assertEqual(points[0][:4], ("bc", 5, "stack", 1))
    stack = by_key["lfgp from clone", 10, "stack"]
    self.assertEqual(stack[3:8], (2, 0.3, 0.2, 0.4, 2.5))
    bring = by_key["lfgp from clone", 10, "bring"]
    self.assertEqual(bring[3:5], (3, 0.8))
    # Of 0.2, 0.4, 0.6, 0.8 the middle ones. Resamples: the greater of two of
    # Stack and the lesser of two of Bring, at the ends (0.2 + 0.6) / 2 and
    # (0.4 + 0.8) / 2, each with a probability of 3/16.
    together = by_key["lfgp from clone", 10, "all"]
    self.assertEqual(together[3:8], (2, 0.5, 0.4, 0.6, 2.5))
    clone = by_key["clone of lfgp", 10, "stack"]
    self.assertEqual(clone[3:5], (1, 0.1))
    np.testing.assert_array_equal(clone[5:], np.full(6, np.nan))

  def test_improvement_over_a_baseline(self):
    _, by_key = self._points("bc")
    # Stack: two losses, two ties of four pairs; Bring: wins alone.
    self.assertEqual(by_key["lfgp from clone", 10, "stack"].improvement, 0.25)
    self.assertEqual(by_key["lfgp from clone", 10, "bring"].improvement, 1)
    self.assertEqual(by_key["lfgp from clone", 10, "all"].improvement, 0.625)
    self.assertTrue(np.isnan(by_key["bc", 10, "all"].improvement))
    with self.assertRaisesRegex(
      ValueError, "no method 'dac'; valid: lfgp from"
    ):
      self._points("dac")

  def test_over_a_single_seed_an_improvement_has_no_interval(self):
    rows = ("lfgp,stack,5,0,,0.8,,", "lfgp,stack,5,1,,0.2,,")
    results = self._read(*rows, "bc,stack,5,0,,0.4,,")
    lfgp = attempts.summary(results, "bc")[0]
    self.assertEqual(lfgp.improvement, 0.5)
    np.testing.assert_array_equal(lfgp[9:], [np.nan, np.nan])

  def test_a_single_seed_has_the_interval_of_its_resets(self):
    header = "method,main_task,attempts,seed,success,episodes"
    (point,) = attempts.summary(
      self._read("bc,stack,5,0,0.5,10", header=header)
    )
    # z = 1.96: 0.5 -+ z sqrt(0.25 / 10 + z^2 / 400) / (1 + z^2 / 10).
    np.testing.assert_allclose(point[4:7], [0.5, 0.2366, 0.7634], atol=1e-4)

  def test_the_table_has_what_is_known(self):
    points, _ = self._points()
    self.assertEqual(attempt_figures.table(points).splitlines(), [
      "| method | attempts | Stack | Bring | All tasks | core hours a run |",
      "| --- | --- | --- | --- | --- | --- |",
      "| BC | 5 | 0 % |  |  |  |",
      "| LfGP from clone | 10 | 30 % (20 to 40) | 80 % (60 to 100) "
      "| 50 % (40 to 60) | 2.9 |",
      "| clone of LfGP | 10 | 10 % |  |  |  |",
      "| BC | 10 | 40 % (40 to 40) | 10 % (10 to 10) | 25 % (25 to 25) |  |",
    ])  # fmt: skip

  def test_where_no_method_has_all_tasks_each_is_compared(self):
    results = self._read("lfgp,stack,10,0,,0.8,,", "bc,stack,10,0,,0.4,,",
                         "lfgp,insert,10,0,,0.8,,", "bc,insert,10,0,,0.9,,",
                         "bc,bring,10,0,,0.4,,")  # fmt: skip
    table = attempt_figures.table(attempts.summary(results, "bc"), "bc")
    better = "probability of improvement over BC"
    header, _, lfgp, _ = table.splitlines()
    self.assertEndsWith(header, f"| {better}, Stack | {better}, Insert |")
    self.assertEndsWith(lfgp, "| 100 % | 0 % |")

  def test_draws_each_task_and_all(self):
    points, _ = self._points()
    with mock.patch.object(drawing, "save", wraps=drawing.save) as save:
      attempt_figures.draw(points, self.folder / "a.png")
    axes = save.call_args.args[0].axes
    titles = [one.get_title() for one in axes]
    self.assertEqual(titles, ["Stack", "Bring", "All tasks"])
    self.assertEqual(
      [t.get_text() for t in axes[0].get_xticklabels()], ["5", "10"]
    )
    self.assertGreater(np.ptp(imageio.imread(self.folder / "a.png")), 200)

  @parameterized.parameters(
    ((), "a.csv has no rows yet"),
    (("bc,stack,10,0,,high,,",), "a.csv, line 2: could not convert .*'high'"),
    (("bc,stack,10,0,,44,,",), "line 2: success is 44; valid: 0 to 1"),
    (("bc,stack,few,0,,0.4,,",), "line 2: invalid literal .*'few'"),
    (("bc,stack,0,0,,0.4,,",), "line 2: attempts is 0; valid: 1 or more"),
    (("bc,all,5,0,,0.4,,",), "line 2: main_task is all; valid: a task"),
    (("bc, stack,5,0,,0.4,,", "bc,stack,5,0,,0.5,,"), "seed 0 .* there twice"),
    (("bc,stack,5,0,,0.4,,",) * 2, "line 3: seed 0 of bc is there twice"),
  )
  def test_damaged_rows_are_told(self, rows, message):
    with self.assertRaisesRegex(ValueError, message):
      self._read(*rows)

  @parameterized.parameters("0", "-5", "0.5", "inf")
  def test_numbers_of_episodes_that_are_none_are_told(self, episodes):
    header, row = f"{_HEADER},episodes", f"bc,stack,5,0,,0.4,,,{episodes}"
    with self.assertRaisesRegex(ValueError, "line 2: episodes is .*; valid: 1"):
      self._read(row, header=header)

  def test_missing_columns_are_told(self):
    with self.assertRaisesRegex(ValueError, "has no column attempts, seed"):
      self._read(header="method,main_task,success")
