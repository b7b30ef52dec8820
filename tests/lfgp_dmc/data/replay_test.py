"""The replay: ring, sampling, withdrawing, mapped files."""

import json

import numpy as np
from absl.testing import parameterized

from lfgp_dmc.data.replay import Replay
from lfgp_dmc.types import Transition
from tests import fixtures


def _transition(number: float) -> Transition:
  return Transition(
    np.full(3, number, np.float32),
    np.full(2, -number, np.float32),
    np.full(3, number + 1, np.float32),
  )


def _fill(replay: Replay, numbers) -> None:
  for number in numbers:
    replay.add(_transition(number))


def _numbers(replay: Replay) -> list[int]:
  rows = replay.gather(np.arange(len(replay)))
  return rows.observation[:, 0].astype(int).tolist()


class ReplayTest(parameterized.TestCase):
  def test_rows_come_back_as_added(self):
    replay = Replay(8, 3, 2)
    _fill(replay, range(3))
    rows = replay.gather(np.array([2, 0]))
    np.testing.assert_array_equal(rows.observation, [[2] * 3, [0] * 3])
    np.testing.assert_array_equal(rows.action, [[-2] * 2, [0] * 2])
    np.testing.assert_array_equal(rows.next_observation, [[3] * 3, [1] * 3])
    self.assertEqual(rows.action.dtype, np.float32)

  def test_a_full_ring_drops_the_oldest(self):
    replay = Replay(4, 3, 2)
    _fill(replay, range(6))
    self.assertLen(replay, 4)
    self.assertEqual(_numbers(replay), [2, 3, 4, 5])

  @parameterized.parameters(3, 5, 11)
  def test_a_batch_equals_its_rows_one_by_one(self, count):
    one, many = Replay(4, 3, 2, slack=2), Replay(4, 3, 2, slack=2)
    rows = [_transition(i) for i in range(count)]
    for row in rows:
      one.add(row)
    many.add_batch(Transition(*map(np.stack, zip(*rows, strict=True))))
    self.assertEqual(_numbers(many), _numbers(one))
    self.assertEqual(many.total, one.total)

  def test_sampling_is_uniform_seeded_and_over_the_ring_only(self):
    replay = Replay(4, 3, 2, slack=3)
    _fill(replay, range(9))
    indices = replay.sample_indices(np.random.default_rng(0), 4000)
    again = replay.sample_indices(np.random.default_rng(0), 4000)
    np.testing.assert_array_equal(indices, again)
    counts = np.bincount(indices, minlength=4)
    self.assertLen(counts, 4)
    self.assertBetween(counts.min(), 900, 1100)

  def test_sampling_an_empty_replay_is_an_error(self):
    with self.assertRaisesRegex(ValueError, "empty"):
      Replay(4, 3, 2).sample_indices(np.random.default_rng(0), 1)

  def test_withdrawing_takes_the_last_rows_back(self):
    replay = Replay(8, 3, 2)
    _fill(replay, range(5))
    replay.withdraw(2)
    self.assertEqual(_numbers(replay), [0, 1, 2])
    _fill(replay, [7])
    self.assertEqual(_numbers(replay), [0, 1, 2, 7])

  def test_withdrawing_from_a_full_ring_shows_no_overwritten_row(self):
    replay = Replay(4, 3, 2)
    _fill(replay, range(6))  # 4 and 5 displaced 0 and 1
    replay.withdraw(2)
    self.assertEqual(_numbers(replay), [2, 3])
    _fill(replay, [6, 7, 8])
    self.assertEqual(_numbers(replay), [3, 6, 7, 8])

  def test_slack_brings_displaced_rows_back(self):
    replay = Replay(4, 3, 2, slack=2)
    _fill(replay, range(6))
    replay.withdraw(2)
    self.assertEqual(_numbers(replay), [0, 1, 2, 3])

  def test_more_rows_than_there_are_cannot_be_withdrawn(self):
    replay = Replay(4, 3, 2)
    with self.assertRaisesRegex(ValueError, "withdraw 1 of 0"):
      replay.withdraw(1)

  def test_rewards_are_kept_beside(self):
    replay = Replay(4, 3, 2, reward_tasks=("lift", "reach"))
    self.assertEqual(replay.reward_tasks, ("lift", "reach"))
    replay.add(_transition(0), np.array([1, 2]))
    replay.add(_transition(1), np.array([3, 4]))
    np.testing.assert_array_equal(
      replay.gather_rewards(np.array([1, 0])), [[3, 4], [1, 2]]
    )

  def test_without_rewards_none_can_be_gathered(self):
    with self.assertRaisesRegex(ValueError, "no rewards"):
      Replay(4, 3, 2).gather_rewards(np.array([0]))


class MappedReplayTest(fixtures.FolderTest):
  def setUp(self):
    super().setUp()
    self._folder = self.folder / "replay"

  def test_a_flushed_replay_reopens_with_its_rows(self):
    replay = Replay(6, 3, 2, self._folder)
    _fill(replay, range(8))
    replay.flush()
    again = Replay(6, 3, 2, self._folder)
    self.assertEqual(_numbers(again), [2, 3, 4, 5, 6, 7])

  def test_rows_after_the_flush_are_not_counted(self):
    replay = Replay(8, 3, 2, self._folder)
    _fill(replay, range(3))
    replay.flush()
    _fill(replay, range(3, 5))
    del replay
    self.assertEqual(_numbers(Replay(8, 3, 2, self._folder)), [0, 1, 2])

  def test_rewinding_goes_back_to_a_checkpoint(self):
    replay = Replay(4, 3, 2, self._folder, slack=2)
    _fill(replay, range(6))
    replay.flush()
    again = Replay(4, 3, 2, self._folder, slack=2)
    again.rewind(5)
    self.assertEqual(_numbers(again), [1, 2, 3, 4])
    with self.assertRaisesRegex(ValueError, "cannot go back"):
      Replay(2, 3, 2).rewind(1)

  def test_rows_overwritten_beyond_the_slack_do_not_come_back(self):
    for slack in (4, 100):
      replay = Replay(10, 3, 2, self._folder / str(slack), slack=slack)
      _fill(replay, range(30))
      replay.flush()
      _fill(replay, range(30, 38))  # killed before the next flush
      again = Replay(10, 3, 2, self._folder / str(slack))
      again.rewind(30)
      intact = _numbers(again)
      self.assertEqual(intact, [*range(20, 30)][-len(intact) :])
      self.assertLen(intact, 10 if slack == 100 else 6)
      _fill(again, range(30, 50))
      again.flush()
      stored = Replay.stored(self._folder / str(slack))
      self.assertEqual(_numbers(stored), [*range(40, 50)])

  def test_a_promise_to_a_flush_outlives_neither_it_nor_a_rewind(self):
    for slack, counts, back, first in (
      (0, (100, 101), 101, 1),
      (5, (105, 111), 111, 11),
      (50, (200, 240), 200, 100),
    ):
      folder = self._folder / str(slack)
      replay, done = Replay(100, 3, 2, folder, slack=slack), 0
      for count in counts:
        _fill(replay, range(done, count))
        replay.flush()
        done = count
      replay.rewind(back)
      _fill(replay, range(back, back + slack + 9))  # then killed
      again = Replay(100, 3, 2, folder)
      again.rewind(back)
      intact = _numbers(again)
      self.assertEqual(intact, [*range(first, back)][-len(intact) :])
      self.assertGreater(len(intact), 60)

  def test_files_are_sparse(self):
    Replay(1_000_000, 59, 4, self._folder)
    used = sum(f.stat().st_blocks * 512 for f in self._folder.iterdir())
    self.assertLess(used, 1_000_000)

  def test_another_width_or_capacity_is_refused(self):
    Replay(4, 3, 2, self._folder).flush()
    with self.assertRaisesRegex(ValueError, "observation.npy"):
      Replay(4, 5, 2, self._folder)
    with self.assertRaisesRegex(ValueError, "capacity 4"):
      Replay(3, 3, 2, self._folder, slack=1)

  def test_damaged_files_are_named(self):
    Replay(4, 3, 2, self._folder).flush()
    path = self._folder / "action.npy"
    path.write_bytes(path.read_bytes()[:-1])
    with self.assertRaisesRegex(ValueError, "action.npy is damaged"):
      Replay(4, 3, 2, self._folder)
    path.unlink()
    with self.assertRaisesRegex(ValueError, "action.npy is damaged: it is mis"):
      Replay(4, 3, 2, self._folder)
    (self._folder / "replay.json").write_text(json.dumps({"total": 1}))
    with self.assertRaisesRegex(ValueError, "replay.json is damaged"):
      Replay(4, 3, 2, self._folder)

  def test_other_reward_tasks_are_refused(self):
    Replay(4, 3, 2, self._folder, reward_tasks=("lift", "reach")).flush()
    with self.assertRaisesRegex(ValueError, "expected .*'reach', 'lift'"):
      Replay(4, 3, 2, self._folder, reward_tasks=("reach", "lift"))

  def test_holds_the_rows_that_could_be_sampled(self):
    replay = Replay(4, 3, 2, self._folder, slack=2, reward_tasks=("a", "b"))
    for number in range(7):
      replay.add(_transition(number), np.array([10, 20]) * number)
    replay.flush()
    stored = Replay.stored(self._folder)
    self.assertEqual(_numbers(stored), [3, 4, 5, 6])
    self.assertEqual((stored.widths, stored.reward_tasks), ((3, 2), ("a", "b")))
    with self.assertRaisesRegex(ValueError, "read-only"):
      stored.add(_transition(8), np.zeros(2))

  def test_another_replay_copies_what_it_has_room_for(self):
    source = Replay(8, 3, 2, reward_tasks=("a", "b"))
    for number in range(5):
      source.add(_transition(number), np.array([10, 20]) * number)
    copy = Replay(2, 3, 2, reward_tasks=("b",))
    self.assertEqual(copy.copy_from(source), 2)
    self.assertEqual(_numbers(copy), [3, 4])
    np.testing.assert_array_equal(
      copy.gather_rewards(np.arange(2)), [[60], [80]]
    )
    with self.assertRaisesRegex(ValueError, "no rewards of c; it keeps: a, b"):
      Replay(2, 3, 2, reward_tasks=("c",)).copy_from(source)
    with self.assertRaisesRegex(ValueError, r"have \(3, 2\) floats.*\(4, 2\)"):
      Replay(2, 4, 2).copy_from(source)

  def test_faults_name_the_file(self):
    with self.assertRaisesRegex(ValueError, "no replay in .*replay.json is mi"):
      Replay.stored(self._folder)
    Replay(4, 3, 2, self._folder).flush()
    (self._folder / "action.npy").write_bytes(b"not an array")
    with self.assertRaisesRegex(ValueError, "action.npy is damaged"):
      Replay.stored(self._folder)
    (self._folder / "replay.json").write_text('{"size": 4}')
    with self.assertRaisesRegex(ValueError, "replay.json is damaged"):
      Replay.stored(self._folder)
