"""Progress in a terminal, and in a log."""

import io
from unittest import mock

from absl.testing import absltest

from lfgp_dmc import progress_bars


class _Terminal(io.StringIO):
  def isatty(self):
    return True


class ProgressBarsTest(absltest.TestCase):
  def _play(self, file, seconds: float, **options) -> str:
    """What two hundred steps leave, each so long by a made-up clock."""
    clock = mock.Mock(return_value=1e6)
    with (
      mock.patch("sys.stderr", file),
      mock.patch("time.time", clock),
      mock.patch.object(progress_bars._Lines, "_printed", 0.0),
      mock.patch("tqdm.std.time", clock),
      progress_bars.bar(
        **{"total": 200, "desc": "training", "unit": "step"} | options
      ) as outer,
      progress_bars.bar(total=200, desc="inner", unit="update") as inner,
    ):
      for i in range(200):
        clock.return_value += seconds
        outer.set_postfix({"right": i})
        inner.update()
        outer.update()
    return file.getvalue()

  def test_a_log_gets_a_plain_line_every_half_minute(self):
    lines = self._play(io.StringIO(), 1.0).split("\n")
    self.assertLen(lines, 7)  # of both together; the last one is empty
    self.assertEqual(
      lines[-2],
      "training: 179 of 200 steps,  1.00step/s, 00:21 left, right=179",
    )
    self.assertNotIn("\r", "".join(lines))
    self.assertEmpty(self._play(io.StringIO(), 0.1))
    endless = self._play(io.StringIO(), 1.0, total=None).split("\n")
    self.assertEqual(
      endless[-2], "training: 179 steps,  1.00step/s, 03:00 so far, right=179"
    )
    hidden = self._play(io.StringIO(), 9.0, show=False)
    self.assertNotIn("training", hidden)

  def test_a_terminal_gets_a_bar(self):
    written = self._play(_Terminal(), 1.0)
    self.assertIn("\r", written)
    self.assertIn("100%|", written)
