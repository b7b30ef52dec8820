"""Checkpoints: round trip, thinning, damage, interruption."""

import pathlib
from unittest import mock

import numpy as np
from absl.testing import parameterized

from lfgp_dmc.runs import checkpoints, pytree
from tests import fixtures

_STATE = {
  "agent": {
    "weights": np.arange(6, dtype=np.float32).reshape(2, 3).T,
    "optimizer": [{"step": np.asarray(3, np.int64)}, [np.ones(2), None]],
    "mask": np.array([True, False]),
    "random": np.random.default_rng(0).bit_generator.state,
  },
  "progress": {"env_step": 360, "rate": 0.5, "name": "lfgp", "done": False},
}


class CheckpointsTest(fixtures.FolderTest):
  def setUp(self):
    super().setUp()
    self._folder = self.folder / "checkpoints"

  def _save(self, *steps: int, run_steps=None):
    for step in steps:
      checkpoints.save(self._folder, step, {"step": step}, run_steps)

  def _steps(self) -> list[int]:
    return [int(path.name) for path in checkpoints.every(self._folder)]

  def test_round_trip(self):
    path = checkpoints.save(self._folder, 360, _STATE)
    read = checkpoints.load(path)
    agent = read["agent"]
    np.testing.assert_array_equal(
      agent["weights"], _STATE["agent"]["weights"], strict=True
    )
    self.assertEqual(agent["optimizer"][0]["step"].shape, ())
    self.assertEqual(agent["optimizer"][0]["step"].dtype, np.int64)
    np.testing.assert_array_equal(agent["optimizer"][1][0], np.ones(2))
    self.assertIsNone(agent["optimizer"][1][1])
    self.assertEqual(agent["mask"].tolist(), [True, False])
    self.assertEqual(agent["random"], _STATE["agent"]["random"])
    self.assertEqual(read["progress"], _STATE["progress"])

  def test_the_last_three_and_one_per_tenth_are_kept(self):
    self._save(*range(50, 1001, 50), run_steps=1000)
    tenths = list(range(100, 1001, 100))
    self.assertEqual(self._steps(), sorted({*tenths, 900, 950, 1000}))

  def test_only_the_last_three_without_a_length(self):
    self._save(1, 2, 3, 4, 5)
    self.assertEqual(self._steps(), [3, 4, 5])

  @parameterized.parameters("arrays.safetensors", "state.json", "manifest.json")
  def test_a_truncated_newest_falls_back(self, name):
    checkpoints.save(self._folder, 1, _STATE)
    newest = checkpoints.save(self._folder, 2, _STATE)
    content = (newest / name).read_bytes()
    (newest / name).write_bytes(content[: len(content) // 2])
    with self.assertLogs(level="WARNING") as logs:
      path = checkpoints.latest(self._folder)
    self.assertEqual(path.name, "000000001")
    self.assertIn(str(newest / name), logs.output[0])
    with self.assertRaises(checkpoints.CheckpointError):
      checkpoints.load(newest)

  def test_an_altered_or_missing_file_is_damage(self):
    path = checkpoints.save(self._folder, 1, _STATE)
    content = bytearray((path / "arrays.safetensors").read_bytes())
    content[-1] ^= 1
    (path / "arrays.safetensors").write_bytes(content)
    with self.assertRaises(checkpoints.CheckpointError):
      checkpoints.load(path)
    (path / "arrays.safetensors").unlink()
    with self.assertRaises(checkpoints.CheckpointError):
      checkpoints.load(path)

  def test_none_is_none(self):
    self.assertIsNone(checkpoints.latest(self._folder))

  def test_a_full_disk_is_named_and_leaves_the_earlier_ones(self):
    self._save(1)
    for state, said in (
      ({"a": np.zeros(9000)}, "it needs 0.0721 MB: .*arrays.safetensors"),
      ({"a": "x" * 90_000}, "it needs 0.09 MB: .*state.json"),
    ):
      with fixtures.full_disk(), self.assertRaisesRegex(OSError, said):
        checkpoints.save(self._folder, 2, state)
    self.assertEqual([p.name for p in self._folder.iterdir()], ["000000001"])
    self.assertEqual(checkpoints.load(self._folder / "000000001"), {"step": 1})

  def test_everybody_may_read_it(self):
    path = checkpoints.save(self._folder, 1, _STATE)
    modes = {file.stat().st_mode & 0o777 for file in path.iterdir()}
    ours = self.folder / "ours"
    ours.touch()
    self.assertEqual(modes, {ours.stat().st_mode & 0o777})

  def test_what_may_not_be_read_is_not_damaged(self):
    path = checkpoints.save(self._folder, 1, _STATE)
    refused = mock.patch("builtins.open", side_effect=PermissionError(13, "no"))
    with refused, self.assertRaises(PermissionError):
      checkpoints.load(path)
    with refused, self.assertRaises(PermissionError):
      checkpoints.latest(self._folder)

  def test_what_is_no_checkpoint_is_left_out(self):
    self._save(1)
    (self._folder / "._000000001").touch()
    (self._folder / "²").touch()
    self.assertEqual(self._steps(), [1])

  def test_what_a_killed_process_left_is_cleared(self):
    self._save(1)
    (self._folder / ".partial-000000002").mkdir()
    self._save(3)
    self.assertLen(list(self._folder.iterdir()), 2)

  def test_a_step_can_be_saved_again(self):
    self._save(1)
    path = checkpoints.save(self._folder, 1, {"step": "again"})
    self.assertEqual(checkpoints.load(path), {"step": "again"})
    self.assertLen(list(self._folder.iterdir()), 1)

  def test_what_cannot_be_replaced_stays(self):
    self._save(1)
    rename = pathlib.Path.rename

    def refused(source, target):
      if source.name == ".partial-000000001":
        raise OSError(5, "Input/output error")
      return rename(source, target)

    with (
      mock.patch.object(pathlib.Path, "rename", refused),
      self.assertRaisesRegex(OSError, "Input/output"),
    ):
      self._save(1)
    self.assertEqual(checkpoints.load(self._folder / "000000001"), {"step": 1})

  def test_what_cannot_be_stored_is_named(self):
    with self.assertRaisesRegex(TypeError, "'agent/0' is a set"):
      pytree.pack({"agent": [set()]})
    with self.assertRaisesRegex(TypeError, r"'agent' has keys \[0\]"):
      pytree.pack({"agent": {0: 1}})
