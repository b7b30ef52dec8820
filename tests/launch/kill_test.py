"""A run killed by SIGKILL at random moments reaches the same numbers.

`KILLS=20 python -m pytest tests/launch/kill_test.py` kills more often than the
suite has time for.
"""

import os
import pathlib
import random
import signal
import subprocess
import sys
import time

from absl import logging
from absl.testing import absltest

from tests.launch import fixtures

_ROOT = pathlib.Path(__file__).parents[2]
_KILLS = int(os.environ.get("KILLS", "2"))
_CHILD = """
import pathlib, sys
from lfgp_dmc.launch import training
from tests.launch import fixtures
data, path = map(pathlib.Path, sys.argv[1:])
config = fixtures.small_config(data, **{
  "env_steps": 1000, "replay_capacity": 1000, "log_every": 100,
  "evaluate_every": 500, "evaluation_episodes": 1})
print("ready", flush=True)
training.train(config, path, resume=path.exists(), progress_bar=False)
"""


class KillTest(absltest.TestCase):
  def _start(self, data: pathlib.Path, path: pathlib.Path) -> subprocess.Popen:
    return subprocess.Popen(
      [sys.executable, "-c", _CHILD, str(data), str(path)],
      cwd=_ROOT,
      stdout=subprocess.PIPE,
      stderr=subprocess.PIPE,
      text=True,
    )

  def _finish(self, process: subprocess.Popen) -> None:
    _, error = process.communicate(timeout=300)
    self.assertEqual(process.returncode, 0, error)

  def test_kills_at_random_moments_leave_the_same_curve(self):
    folder = pathlib.Path(self.create_tempdir().full_path)
    data = fixtures.write_dataset(folder / "data")
    self._finish(self._start(data, folder / "whole"))
    drawn = random.Random(0)
    killed = 0
    while killed < _KILLS:
      process = self._start(data, folder / "killed")
      assert process.stdout is not None
      self.assertEqual(process.stdout.readline(), "ready\n")
      # From the first instants of a run; a checkpoint falls every 40 steps.
      time.sleep(drawn.uniform(0.0, 2.0))
      if process.poll() is not None:
        self._finish(process)
        break
      process.send_signal(signal.SIGKILL)
      process.communicate()
      killed += 1
    self._finish(self._start(data, folder / "killed"))
    logging.info("killed %d times", killed)
    self.assertGreater(killed, 0)
    self.assertEqual(
      fixtures.numbers(folder / "killed"), fixtures.numbers(folder / "whole")
    )
