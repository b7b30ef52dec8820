"""The published states of success, read into our layout."""

import pathlib
import shutil

import numpy as np
from absl.testing import absltest

from lfgp_dmc.data import demonstrations
from lfgp_dmc.tasks import published_examples

_DATA = pathlib.Path(__file__).parents[1] / "data"


class PublishedExamplesTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)
    for task in ("stack", "lift"):
      with np.load(_DATA / f"published_{task}.npz", allow_pickle=False) as part:
        rows = {name: part[name][:200] for name in part.files}
      rows["observation"] = rows["next_observation"]
      np.savez(self.folder / f"{task}.npz", **rows)

  def test_rows_are_upright_cubes_with_our_slots(self):
    found = published_examples.read_folder(self.folder, ("stack", "lift"))
    self.assertTrue(published_examples.is_folder_of_examples(self.folder))
    for data in found.values():
      self.assertLen(data, 200)
      self.assertTrue(data.is_last.all())
      self.assertEqual(data.episode.tolist(), list(range(200)))
      rows = data.next_observation
      for start in (15, 22):
        rotation = rows[:, start : start + 4]
        np.testing.assert_allclose(
          np.linalg.norm(rotation, axis=1), 1, atol=1e-4
        )
        # The farthest that a rotation is from the cube's group: 62.8 degrees.
        self.assertGreater(rotation[:, 0].min(), np.cos(np.radians(31.5)))
      slot = rows[:, 12:15] + rows[:, 47:50]
      np.testing.assert_allclose(slot, [[0.075, 0.5, 0.135]] * 200, atol=1e-5)
    stacked = found["stack"].next_observation
    above = np.median(stacked[:, 14] - stacked[:, 21])
    self.assertAlmostEqual(float(above), 0.04, delta=0.002)

  def test_upright_blocks_lie_flat_or_held(self):
    found = published_examples.read_folder(self.folder, ("stack",))
    rotation = found["stack"].next_observation[:, 15:19]
    tilt = np.linalg.norm(rotation[:, 1:3], axis=1)
    self.assertLess(np.median(tilt), 0.02)

  def test_every_fault_is_told(self):
    shutil.copy(self.folder / "lift.npz", self.folder / "bring.npz")
    (self.folder / "lift.npz").write_bytes(b"nothing")
    np.savez(
      self.folder / "bring.npz",
      observation=np.zeros((2, 53)),
      action=np.zeros((2, 4)),
      next_observation=np.zeros((2, 53)),
    )
    with self.assertRaisesRegex(
      demonstrations.DatasetError,
      r"(?s)lift.npz: .*bring.npz: arrays of shapes.*reach.npz: missing",
    ):
      published_examples.read_folder(
        self.folder, ("stack", "lift", "bring", "reach")
      )


if __name__ == "__main__":
  absltest.main()
