"""The copy of the replay on the device always holds what the replay holds."""

from unittest import mock

import numpy as np
import torch
from absl.testing import absltest

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp import device_replay
from lfgp_dmc.agents.lfgp.device_replay import DeviceReplay
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.types import Transition

OBS, A = 3, 2


class DeviceReplayTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.replay = Replay(50, OBS, A, slack=10)
    self.rows = DeviceReplay(self.replay, torch.device("cpu"))
    self.seed = 0

  def _add(self, count):
    self.seed += 1
    made = synthetic.transitions(count, OBS, A, self.seed)
    self.replay.add_batch(Transition(*made))

  def _check(self):
    indices = np.arange(len(self.replay))[::-1].copy()
    both = (self.rows.gather(indices), self.replay.gather(indices))
    for one, other in zip(*both, strict=True):
      np.testing.assert_array_equal(one.numpy(), other)

  def test_follows_additions_also_around_the_ring(self):
    for count in (1, 20, 29, 7, 50, 200, 3):
      self._add(count)
      self._check()

  def test_follows_withdrawals_that_were_replaced(self):
    self._add(30)
    self._check()
    self.replay.withdraw(10)
    self._add(25)  # more rows than before, and other ones from the 20th on
    self._check()
    self._add(30)
    self._check()
    self.replay.rewind(self.replay.total - 5)
    self._add(5)
    self._check()

  def test_rows_that_return_to_a_full_ring_return_here(self):
    self._add(70)
    self._check()
    self.replay.withdraw(8)
    self._check()
    self._add(3)
    self._check()

  def test_starts_from_a_replay_that_is_full(self):
    self._add(70)
    self.rows = DeviceReplay(self.replay, torch.device("cpu"))
    self._check()

  def test_takes_memory_for_the_rows_that_there_are(self):
    self.enter_context(mock.patch.object(device_replay, "_CHUNK", 8))
    for count, room in ((3, 8), (6, 16), (20, 32), (30, 50), (40, 50)):
      self._add(count)
      self._check()
      for column in self.rows._columns:
        self.assertLen(column, room)
