"""Our conditions, asked of states of success from the authors' own world."""

import pathlib

import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc

_DATA = pathlib.Path(__file__).parents[1] / "data"
_ROWS = slice(0, 1200, 3)


def _pose(row, start):
  """Position and quaternion w x y z from the published x y z w."""
  position = row[start : start + 3]
  x, y, z, w = row[start + 3 : start + 7]
  return np.array([*position, w, x, y, z], np.float64)


class PublishedExamplesTest(parameterized.TestCase):
  @parameterized.parameters("stack", "lift", "reach")
  def test_conditions_hold_on_98_percent_of_the_states(self, task):
    with np.load(_DATA / f"published_{task}.npz", allow_pickle=False) as data:
      rows = data["next_observation"][_ROWS].astype(np.float64)
      grips = data["action"][_ROWS, 3]
    env = lfgp_dmc.load("stack", seed=0)
    holding = []
    for row, grip in zip(rows, grips, strict=True):
      env.reset_to(
        tcp=row[0:3],
        blue=_pose(row, 12),
        green=_pose(row, 19),
        fingers=float(np.clip(row[6:8].mean(), 0.0, 1.0)),
      )
      observed = env.step([0.0, 0.0, 0.0, grip]).observation
      holding.append(bool(observed[f"condition/{task}"]))
    self.assertGreaterEqual(np.mean(holding), 0.98)


if __name__ == "__main__":
  absltest.main()
