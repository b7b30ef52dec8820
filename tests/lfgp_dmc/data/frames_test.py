"""Demonstrations with frames: each stored once, checked, and left on disk."""

import dataclasses
import tempfile

import h5py
import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc.data import demonstrations
from lfgp_dmc.data.demonstrations import DatasetError
from tests import fixtures

_DATA = fixtures.with_frames(fixtures.demonstrations(3, 1, 2))
_SHAPE = (2, 20, 20, 3)


class FramesTest(fixtures.FolderTest):
  def setUp(self):
    super().setUp()
    self._path = self.folder / "reach.hdf5"

  def _write(self):
    demonstrations.write(self._path, _DATA, fixtures.ATTRIBUTES)

  def test_neighbouring_rows_share_a_frame(self):
    np.testing.assert_array_equal(_DATA.frame_rows(), [0, 1, 2, 4, 6, 7])

  def test_round_trip_leaves_them_on_disk(self):
    self._write()
    read = demonstrations.read(self._path, "reach", 5, 2, _SHAPE)
    self.assertIsInstance(read.frames, np.memmap)
    np.testing.assert_array_equal(read.frames, _DATA.frames)
    self.assertEqual(read.attributes["schema_version"], 2)
    with h5py.File(self._path) as file:
      self.assertEqual(file["frames"].compression, "gzip")
      self.assertTrue(file["frames"].fletcher32)

  @parameterized.parameters((3, 4), (2, 3), (4, 6), (5, 8), (6, 9))
  def test_head_keeps_what_the_last_row_led_to(self, pairs, frames):
    head = _DATA.head(pairs)
    np.testing.assert_array_equal(head.frames, _DATA.frames[:frames])

  @parameterized.named_parameters(
    ("rows", lambda f: f[1:], r"shape \[8, 2, 20, 20, 3\]; valid: \[9, 2, 20"),
    ("size", lambda f: f[:, :, :9], r"valid: \[9, 2, 20, 20, 3\]"),
    ("cameras", lambda f: f[:, :1], r"valid: \[9, 2, 20, 20, 3\]"),
    ("colours", lambda f: f[..., :1], r"shape \[9, 2, 20, 20, 1\]"),
    ("dtype", lambda f: f.astype(float), "'frames' is float64; valid: uint8"),
    ("dimensions", lambda f: f[..., 0], r"'frames' has shape \[9, 2, 20, 20\]"),
  )
  def test_fault(self, change, message):
    self._write()
    with h5py.File(self._path, "r+") as file:
      del file["frames"]
      file["frames"] = change(_DATA.frames)
    with self.assertRaisesRegex(DatasetError, message):
      demonstrations.read(self._path, "reach", 5, 2, _SHAPE)

  def test_without_frames_where_they_are_needed_and_the_reverse(self):
    self._write()
    with self.assertRaisesRegex(DatasetError, "has frames; valid: none"):
      demonstrations.read(self._path, "reach", 5, 2, ())
    with h5py.File(self._path, "r+") as file:
      del file["frames"]
    with self.assertRaisesRegex(DatasetError, "has no frames; valid"):
      demonstrations.read(self._path, "reach", 5, 2, _SHAPE)

  def test_a_full_disk_for_temporary_files_is_no_fault_of_the_data(self):
    self._write()
    with (
      fixtures.full_disk(),
      self.assertRaisesRegex(OSError, f"too large: '{tempfile.gettempdir()}'"),
    ):
      demonstrations.read(self._path, "reach", 5, 2, _SHAPE)

  def test_a_flipped_bit_is_found(self):
    self._write()
    with h5py.File(self._path) as file:
      chunk = file["frames"].id.get_chunk_info(0)
    with open(self._path, "r+b") as file:
      file.seek(chunk.byte_offset + chunk.size // 2)
      byte = file.read(1)[0]
      file.seek(-1, 1)
      file.write(bytes([byte ^ 1]))
    with self.assertRaisesRegex(DatasetError, "not a readable HDF5 file"):
      demonstrations.read(self._path, "reach", 5, 2, _SHAPE)

  def test_bad_frames_are_not_written(self):
    bad = dataclasses.replace(_DATA, frames=_DATA.frames[1:])
    with self.assertRaisesRegex(DatasetError, "not written: 'frames'"):
      demonstrations.write(self._path, bad, fixtures.ATTRIBUTES)
    self.assertFalse(self._path.exists())


if __name__ == "__main__":
  absltest.main()
