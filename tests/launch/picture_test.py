"""The picture of a run: what each algorithm logs, and what stops it."""

from unittest import mock

import numpy as np
from absl.testing import parameterized

from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.launch import training
from lfgp_dmc.study import drawing, run_picture
from tests.launch import fixtures

_VALUES = ("reward, mean of the batch", "Q, mean of the batch", "temperature")
_ACCURACIES = (
  "discriminators, expert rows",
  "discriminators, the agent's rows",
)
_UNIFORM = {"agent.scheduler.kind": "uniform"}
_LOSSES = ("cloning, training pairs", "cloning, validation pairs")


class PictureTest(fixtures.RunTest):
  @parameterized.parameters(
    ({}, (*_VALUES, *_ACCURACIES), 2),
    ({"algorithm": "dac"}, (*_VALUES, *_ACCURACIES), 1),
    ({"agent.reward.kind": "examples", **_UNIFORM}, _VALUES, 2),
    ({"algorithm": "sacx", "demonstrations": "", **_UNIFORM}, _VALUES, 2),
    ({"algorithm": "bc"}, _LOSSES, 1),
    ({"algorithm": "multitask_bc"}, _LOSSES, 2),
  )
  def test_shows_what_an_algorithm_logs(self, changes, panels, tasks):
    run, _ = self.train(self.config(env_steps=60, **changes))
    with mock.patch.object(drawing, "save") as save:
      run_picture.draw(run, run / "a.png")
    drawn = save.call_args.args[0]
    shown = [axes for axes in drawn.axes if axes.get_visible()]
    titles = [axes.get_title() for axes in shown]
    self.assertCountEqual(titles, ["success in evaluation", *panels])
    for axes in shown:
      self.assertLen(axes.lines, tasks)
      self.assertEqual(axes.lines[0].get_xdata()[-1], 60)
    self.assertLen(drawn.legends[0].get_texts(), tasks)

  def test_a_half_written_line_waits_for_the_next_picture(self):
    run, _ = self.train(self.config(env_steps=60))
    for name in ("metrics.csv", "evaluation.csv"):
      text = (run / name).read_text()
      (run / name).write_text(text[: -len(text.splitlines()[-1]) // 2])
    with mock.patch.object(drawing, "save") as save:
      run_picture.draw(run, run / "a.png")
    for axes in save.call_args.args[0].axes:
      last = 60 if axes.get_title().startswith("success") else 40
      self.assertEqual(axes.lines[0].get_xdata()[-1], last)

  def test_what_is_evaluated_later_stands_at_its_step(self):
    run, _ = self.train(self.config(env_steps=60, evaluate_first=True))
    path = run / "evaluation.csv"
    rows = evaluation_csv.read_csv(path)
    again = [row._replace(seed=9) for row in rows if not row.env_step]
    evaluation_csv.append_csv(path, again)
    with mock.patch.object(drawing, "save") as save:
      run_picture.draw(run, run / "a.png")
    (line, *_) = save.call_args.args[0].axes[0].lines
    np.testing.assert_array_equal(line.get_xdata(), [0, 60])

  def test_training_does_not_fail_with_its_picture(self):
    run, _ = self.train(self.config(env_steps=60))
    with (
      mock.patch.object(drawing, "styles_of", side_effect=RuntimeError("ink")),
      self.assertLogs(level="WARNING") as logs,
    ):
      self.assertIsNone(training.draw(run))
    self.assertIn("no picture of the run: ink", logs.output[0])
    self.assertFalse((run / run_picture.NAME).exists())

  def test_no_rows_no_place_and_damage_are_told(self):
    run, _ = self.train(self.config(env_steps=60))
    (self.folder / "file").touch()
    for change, message in (
      ("", "cannot write .*file/a.png: "),
      ("env_step,reward/right\n20,high\n", "metrics.csv is damaged: .*'high'"),
      ("step\n20\n", "metrics.csv is damaged: KeyError.'env_step'"),
      ("env_step,reward/right\n20,nan\n", "has nothing to draw yet"),
    ):
      if change:
        (run / "metrics.csv").write_text(change)
        (run / "evaluation.csv").unlink(missing_ok=True)
      with self.assertRaisesRegex(ValueError, message):
        run_picture.draw(run, self.folder / "file" / "a.png")
