"""A run killed by SIGKILL at random moments reaches the same numbers.

`KILLS=20 python -m pytest tests/launch/kill_test.py` kills more often than the
suite has time for.
"""

import os
import pathlib
import random
import time

from absl import logging

from lfgp_dmc.launch import training
from tests import fixtures as shared
from tests.launch import fixtures, forked

_KILLS = int(os.environ.get("KILLS", "2"))


def _train(data: pathlib.Path, path: pathlib.Path, ready) -> None:
  config = fixtures.small_config(
    data,
    env_steps=1000,
    evaluate_every=500,
    evaluation_episodes=1,
    log_every=100,
    replay_capacity=1000,
  )
  ready.set()
  training.train(config, path, resume=path.exists(), progress_bar=False)


class KillTest(shared.FolderTest):
  def _start(self, name: str):
    """A process that trains in this folder, as soon as it begins."""
    ready = forked.server().Event()
    arguments = (self.folder / "data", self.folder / name, ready)
    process = forked.server().Process(target=_train, args=arguments)
    process.start()
    self.assertTrue(ready.wait(60))
    return process

  def _finish(self, process) -> None:
    process.join(300)
    self.assertEqual(process.exitcode, 0)

  def test_kills_at_random_moments_leave_the_same_curve(self):
    fixtures.write_dataset(self.folder / "data")
    self._finish(self._start("whole"))
    drawn = random.Random(0)
    killed = 0
    while killed < _KILLS:
      process = self._start("killed")
      # From the first instants of a run; a checkpoint falls every 40 steps.
      time.sleep(drawn.uniform(0.0, 2.0))
      if not process.is_alive():
        self._finish(process)
        break
      process.kill()
      process.join()
      killed += 1
    self._finish(self._start("killed"))
    logging.info("killed %d times", killed)
    self.assertGreater(killed, 0)
    self.assertEqual(
      *(fixtures.numbers(self.folder / name) for name in ("killed", "whole"))
    )
