"""The authors' published states of success, in our layout and our world."""

import pathlib

import numpy as np
from absl.testing import parameterized

from lfgp_dmc.data import demonstrations
from lfgp_dmc.tasks import published_examples
from lfgp_dmc.tasks import workspace as ws
from tests.fixtures import FolderTest
from tests.tasks import fixtures

_DATA = pathlib.Path(__file__).parents[1] / "data"


class PublishedExamplesTest(FolderTest):
  def setUp(self):
    super().setUp()
    for task in ("stack", "lift", "reach"):
      with np.load(_DATA / f"published_{task}.npz", allow_pickle=False) as part:
        rows = {name: part[name][::3] for name in part.files}
      rows["observation"] = rows["next_observation"]
      np.savez(self.folder / f"{task}.npz", **rows)

  def read(self, *tasks):
    return published_examples.read_folder(self.folder, tasks)

  def test_rows_are_upright_cubes_with_our_slots(self):
    self.assertTrue(published_examples.is_folder_of_examples(self.folder))
    found = self.read("stack", "lift")
    for data in found.values():
      self.assertLen(data, 400)
      self.assertTrue(data.is_last.all())
      self.assertEqual(data.episode.tolist(), list(range(400)))
      rows = data.next_observation
      for start in (15, 22):
        rotation = rows[:, start : start + 4]
        norm = np.linalg.norm(rotation, axis=1)
        np.testing.assert_allclose(norm, 1, atol=1e-4)
        # The farthest that a rotation is from the cube's group: 62.8 degrees.
        self.assertGreater(rotation[:, 0].min(), np.cos(np.radians(31.5)))
      slot = rows[:, 12:15] + rows[:, 47:50]
      np.testing.assert_allclose(slot, [ws.BLUE_SLOT] * 400, atol=1e-5)
    stacked = found["stack"].next_observation
    above = np.median(stacked[:, 14] - stacked[:, 21])
    self.assertAlmostEqual(float(above), 0.04, delta=0.002)
    tilt = np.linalg.norm(stacked[:, 16:18], axis=1)
    self.assertLess(np.median(tilt), 0.02)

  def test_actions_beyond_the_bounds_are_clipped(self):
    path = self.folder / "lift.npz"
    with np.load(path, allow_pickle=False) as part:
      rows = dict(part)
    rows["action"][1] = (1.5, -2.0, 0.5, 1.0)
    np.savez(path, **rows)
    found = self.read("lift")["lift"].action
    np.testing.assert_array_equal(found[1], [1.0, -1.0, 0.5, 1.0])
    self.assertEqual(found.dtype, np.float32)

  def test_every_fault_is_reported(self):
    (self.folder / "lift.npz").write_bytes(b"nothing")
    rows = {"observation": np.zeros((2, 53)), "action": np.zeros((2, 4))}
    rows["next_observation"] = rows["observation"]
    np.savez(self.folder / "bring.npz", **rows)
    with self.assertRaisesRegex(
      demonstrations.DatasetError,
      r"(?s)lift.npz: .*bring.npz: arrays of shapes.*insert.npz: missing",
    ):
      self.read("stack", "lift", "bring", "insert")

  @parameterized.parameters(b"", b"PK\x03\x04nothing")
  def test_a_damaged_file_is_named(self, content):
    (self.folder / "lift.npz").write_bytes(content)
    with self.assertRaisesRegex(demonstrations.DatasetError, "lift.npz: "):
      self.read("lift")

  def test_stray_files_are_no_examples(self):
    for path in self.folder.iterdir():
      path.rename(path.with_name(f"._{path.name}"))
    self.assertFalse(published_examples.is_folder_of_examples(self.folder))

  @parameterized.parameters("stack", "lift", "reach")
  def test_our_conditions_hold_on_98_percent_of_the_states(self, task):
    data, env = self.read(task)[task], fixtures.environment()
    holding = []
    for row, action in zip(data.next_observation, data.action, strict=True):
      fingers = float(np.clip(row[6:8].mean(), 0.0, 1.0))
      env.reset_to(row[:3], row[12:19], row[19:26], fingers)
      observed = env.step([0.0, 0.0, 0.0, action[3]]).observation
      holding.append(bool(observed[f"condition/{task}"]))
    self.assertGreaterEqual(np.mean(holding), 0.98)
