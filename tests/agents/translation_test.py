"""Shifts in the plane: what moves, what stays; rows held at the end."""

import numpy as np
import torch
from absl.testing import absltest

from agents import translation
from agents.experts import ExpertPool
from lfgp_dmc import observations
from lfgp_dmc.demonstrations import Demonstrations


def _rows(count: int) -> torch.Tensor:
  """Made-up observations that agree with themselves."""
  random = np.random.default_rng(0)
  rows = np.zeros((count, 59), np.float32)
  slots = random.uniform(-0.1, 0.1, (count, 4))
  slots[:, 1::2] += 0.5
  for first in (0, 12, 19):
    rows[:, first : first + 2] = random.uniform(-0.1, 0.1, (count, 2))
    rows[:, first + 1] += 0.5
  rows[:, 47:49] = slots[:, :2] - rows[:, 12:14]
  rows[:, 50:52] = slots[:, 2:] - rows[:, 19:21]
  return torch.from_numpy(rows)


class TranslationTest(absltest.TestCase):
  def test_all_moves_but_what_is_fixed(self):
    rows = _rows(200)
    reach = np.full(200, 0.08)
    moved, later = translation.shifted(
      rows, rows.flip(0), reach, np.random.default_rng(1)
    )
    shift = moved[:, :2] - rows[:, :2]
    for at in ((12, 13), (19, 20)):
      torch.testing.assert_close(moved[:, at] - rows[:, at], shift)
      torch.testing.assert_close(later[:, at] - rows.flip(0)[:, at], shift)
    for at, block in (((47, 48), (12, 13)), ((50, 51), (19, 20))):
      torch.testing.assert_close(
        moved[:, at] + moved[:, block], rows[:, at] + rows[:, block]
      )
    self.assertLessEqual(shift.abs().max(), 0.08)
    self.assertGreater(shift.abs().mean(), 0.01)
    positions = moved[:, [0, 1, 12, 13, 19, 20]].view(-1, 3, 2)
    self.assertTrue((positions[..., 0].abs() <= 0.1501).all())
    planar = (0, 1, 12, 13, 19, 20, 47, 48, 50, 51)
    same = [i for i in range(59) if i not in planar]
    torch.testing.assert_close(moved[:, same], rows[:, same])
    for name, at in (("block_positions", 12), ("slots_from_blocks", 47)):
      parts = observations.OBSERVATION_SLICES[name].slices
      self.assertEqual(parts[0].start, at)


class LastRowsTest(absltest.TestCase):
  def test_the_last_rows_of_an_attempt_are_rows_of_success(self):
    rows = _rows(9).numpy()
    shown = Demonstrations(
      rows,
      np.zeros((9, 4), np.float32),
      rows,
      np.array([0, 0, 0, 0, 1, 2, 2, 3, 3], np.int32),
      np.array([0, 0, 0, 1, 1, 0, 1, 0, 0], bool),
    )
    pool = ExpertPool(
      {"stack": shown}, ("stack",), lambda rows: rows, final_rows=3
    )
    self.assertEqual(pool._finals.tolist(), [1, 2, 3, 4, 5, 6])
    self.assertEqual(pool._rest.tolist(), [0, 7, 8])


if __name__ == "__main__":
  absltest.main()
