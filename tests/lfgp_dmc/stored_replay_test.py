"""The replay of another run, read back: rows, order, rewards, faults."""

import pathlib

import numpy as np
from absl.testing import absltest

from lfgp_dmc.data import files
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.data.stored_replay import StoredReplay
from lfgp_dmc.types import Transition


def _transition(number):
  row = np.full(3, number, np.float32)
  return Transition(row, np.full(2, -number, np.float32), row + 0.5)


class StoredReplayTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path) / "replay"

  def _fill(self, rows, capacity, slack=0, reward_tasks=()):
    replay = Replay(
      capacity, 3, 2, self.folder, slack=slack, reward_tasks=reward_tasks
    )
    for number in range(rows):
      rewards = np.full(len(reward_tasks), 10 * number)
      replay.add(_transition(number), rewards)
    replay.flush()

  def _numbers(self, **options):
    parts = list(StoredReplay(self.folder).chunks(**options))
    for transition, _ in parts:
      np.testing.assert_array_equal(
        transition.next_observation, transition.observation + 0.5
      )
    return [int(n) for part, _ in parts for n in part.observation[:, 0]]

  def test_rows_come_oldest_first_without_those_dropped(self):
    self._fill(rows=7, capacity=4, slack=2)
    self.assertEqual(self._numbers(), [3, 4, 5, 6])
    self.assertEqual(self._numbers(newest=2), [5, 6])
    self.assertLen(StoredReplay(self.folder), 4)
    self.assertEqual(StoredReplay(self.folder).widths, (3, 2))

  def test_rewards_come_with_their_tasks(self):
    self._fill(rows=3, capacity=4, reward_tasks=("lift", "reach"))
    stored = StoredReplay(self.folder)
    self.assertEqual(stored.reward_tasks, ("lift", "reach"))
    ((_, rewards),) = stored.chunks()
    np.testing.assert_array_equal(rewards, [[0, 0], [10, 10], [20, 20]])

  def test_a_replay_is_not_opened_with_other_reward_tasks(self):
    self._fill(rows=3, capacity=4, reward_tasks=("lift", "reach"))
    with self.assertRaisesRegex(ValueError, "expected .*'reach', 'lift'"):
      Replay(4, 3, 2, self.folder, reward_tasks=("reach", "lift"))

  def test_faults_name_the_file(self):
    with self.assertRaisesRegex(ValueError, "no replay in .*replay.json is mi"):
      StoredReplay(self.folder)
    self._fill(rows=3, capacity=4)
    (self.folder / "action.npy").write_bytes(b"not an array")
    with self.assertRaisesRegex(ValueError, "action.npy cannot be read"):
      StoredReplay(self.folder)
    files.write_json(self.folder / "replay.json", {"size": 4})
    with self.assertRaisesRegex(ValueError, "replay.json is damaged"):
      StoredReplay(self.folder)


if __name__ == "__main__":
  absltest.main()
