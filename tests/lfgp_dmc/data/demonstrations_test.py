"""Demonstrations: round trip, atomic writing, and every fault by name."""

import dataclasses
import pathlib
from unittest import mock

import h5py
import numpy as np
from absl.testing import parameterized

from lfgp_dmc.data import demonstration_summary, demonstrations
from lfgp_dmc.data.demonstrations import DatasetError
from tests import fixtures

_DATA = fixtures.demonstrations(3, 3)

# A fault of the arrays: what replaces which array, and what is said of it.
_FAULTS = {
  "shape": ("action", lambda a: a[:, :1], r"'action' has shape \[6, 1\]"),
  "rows": ("episode", lambda a: a[:-1], r"'episode' has shape \[5\]"),
  "dtype": ("action", np.float64, "'action' is float64; valid: float32"),
  "nan": (
    "observation",
    lambda a: np.where(a == a[2], np.float32(np.nan), a),
    "NaN or infinity in 1 rows, first in row 2",
  ),
  "nan_after": (
    "next_observation",
    lambda a: np.where(a == a[4], np.float32(np.inf), a),
    "'next_observation' has NaN or infinity in 1 rows, first in row 4",
  ),
  "range": ("action", lambda a: a * 3, r"'action' leaves \[-1, 1\]"),
  "empty": ("observation", lambda a: a[:0], "holds no pair"),
  "negative": ("episode", lambda a: a - 1, "'episode' is negative"),
  "decreasing": ("episode", lambda a: a[::-1].copy(), "decreases"),
  "inside": ("is_last", np.ones_like, "true inside an episode"),
}
_BAD_ATTRIBUTES = {
  "task": ("lift", "task is 'lift'; expected 'reach'"),
  "collection": ("dream", "collection is 'dream'; valid: reset, play"),
  "seed": (-1, "seed is -1"),
  "control_hz": (0.0, "control_hz is 0.0"),
  "schema_version": (9, "schema_version is 9; valid: 1 or 2"),
}


class DemonstrationsTest(fixtures.FolderTest):
  def setUp(self):
    super().setUp()
    self._path = self.folder / "reach.hdf5"

  def _write(self, task: str = "reach") -> pathlib.Path:
    path = self.folder / f"{task}.hdf5"
    attributes = {**fixtures.ATTRIBUTES, "task": task}
    demonstrations.write(path, _DATA, attributes)
    return path

  def _replace(self, name: str, array: np.ndarray) -> None:
    with h5py.File(self._path, "r+") as file:
      del file[name]
      file[name] = array

  def _read_error(self) -> str:
    with self.assertRaises(DatasetError) as caught:
      demonstrations.read_folder(self.folder, ("reach",), 5, 2)
    lines = str(caught.exception).splitlines()
    self.assertLen(lines, 2)
    self.assertStartsWith(lines[1], str(self._path))
    return lines[1]

  def test_round_trip(self):
    self._write()
    read = demonstrations.read(self._path, "reach", 5, 2)
    for name, array in _DATA.arrays().items():
      np.testing.assert_array_equal(getattr(read, name), array)
      self.assertEqual(getattr(read, name).dtype, array.dtype)
    self.assertEqual(
      dict(read.attributes), {**fixtures.ATTRIBUTES, "schema_version": 1}
    )
    self.assertLen(read.head(4), 4)

  def test_attempts_of_other_widths_are_named(self):
    attempts = [
      (np.zeros((3, width)), np.zeros((2, 2)), np.array([False, True]))
      for width in (4, 4, 5)
    ]
    with self.assertRaisesRegex(
      demonstrations.DatasetError,
      r"attempt 2 has states and actions of \(\(5,\), \(2,\)\), the first of",
    ):
      demonstrations.from_attempts(attempts)
    self.assertLen(demonstrations.from_attempts(attempts[:2]), 4)

  def test_the_first_whole_attempts(self):
    self.assertEqual(_DATA.attempts, 1)  # the second is cut
    for wanted in (1, 2):
      first = _DATA.head_attempts(wanted)
      np.testing.assert_array_equal(first.action, _DATA.action[:3])
      self.assertTrue(first.is_last[-1])

  def test_the_same_data_are_the_same_bytes(self):
    self._write()
    first = self._path.read_bytes()
    self._path.unlink()
    self._write()
    self.assertEqual(self._path.read_bytes(), first)

  def test_an_interrupted_write_leaves_nothing(self):
    interrupt = mock.patch.object(
      h5py.Group, "create_dataset", side_effect=KeyboardInterrupt
    )
    with interrupt, self.assertRaises(KeyboardInterrupt):
      self._write()
    self.assertEmpty(list(self.folder.iterdir()))

  def test_a_full_disk_leaves_nothing(self):
    with fixtures.full_disk(1000), self.assertRaises(OSError):
      self._write()
    self.assertEmpty(list(self.folder.iterdir()))

  def test_nothing_is_overwritten(self):
    self._write()
    with self.assertRaises(FileExistsError):
      self._write()
    with self.assertRaisesRegex(FileExistsError, "never written into"):
      demonstrations.write_folder(self.folder, {})

  @parameterized.parameters(
    ({"action": np.ones(3)},), ({"attributes": {"task": "x"}},), ({},)
  )
  def test_a_folder_is_whole_or_absent(self, change):
    bad = dataclasses.replace(_DATA, **change)
    found = {"reach": _DATA, "lift" if change else "a/b": bad}
    with self.assertRaises(DatasetError):
      demonstrations.write_folder(self.folder / "new", found)
    self.assertEmpty(list(self.folder.iterdir()))
    demonstrations.write_folder(self.folder / "new", {"reach": _DATA})
    self.assertLen(list(self.folder.iterdir()), 1)

  def test_bad_data_are_not_written(self):
    bad = dataclasses.replace(_DATA, action=np.full((6, 2), 2, np.float32))
    with self.assertRaisesRegex(DatasetError, "not written: 'action'"):
      demonstrations.write(self._path, bad, fixtures.ATTRIBUTES)
    self.assertFalse(self._path.exists())

  @parameterized.named_parameters((k, *v) for k, v in _FAULTS.items())
  def test_fault_of_an_array(self, name, change, message):
    self._write()
    self._replace(name, change(getattr(_DATA, name)))
    self.assertRegex(self._read_error(), message)

  @parameterized.named_parameters(
    (k, k, *v) for k, v in _BAD_ATTRIBUTES.items()
  )
  def test_fault_of_an_attribute(self, name, value, message):
    self._write()
    with h5py.File(self._path, "r+") as file:
      file.attrs[name] = value
    self.assertIn(message, self._read_error())

  @parameterized.parameters(*_BAD_ATTRIBUTES, "main_task", "expert")
  def test_an_attribute_of_another_type_is_named(self, name):
    self._write()
    for value in (np.arange(3), np.array(["a", "b"], "S"), h5py.Empty("f")):
      with h5py.File(self._path, "r+") as file:
        file.attrs[name] = value
      self.assertRegex(self._read_error(), f"{name} is a (ndarray|Empty)")

  @parameterized.parameters(*_DATA.arrays())
  def test_an_array_that_declares_more_than_there_is(self, name):
    self._write()
    with h5py.File(self._path, "r+") as file:
      del file[name]
      file.create_dataset(name, (10**12,), np.float32)
    self.assertRegex(self._read_error(), f"'{name}' declares 4,000,000,000,000")
    with h5py.File(self._path, "r+") as file:
      del file[name]
      file[name] = h5py.Empty("f")
    self._read_error()

  def test_missing_key_and_missing_attribute(self):
    self._write()
    with h5py.File(self._path, "r+") as file:
      del file["is_last"]
      del file.attrs["expert"]
    line = self._read_error()
    self.assertIn("missing dataset 'is_last'", line)
    self.assertIn("missing attribute 'expert'", line)

  def test_wrong_width(self):
    self._write()
    with self.assertRaisesRegex(DatasetError, r"valid: \[6, 59\]"):
      demonstrations.read(self._path, "reach", 59, 2)

  @parameterized.parameters(0, 10, 900, 0.5, 0.9)
  def test_truncated_file(self, length):
    path = self._write()
    content = path.read_bytes()
    if isinstance(length, float):
      length = int(len(content) * length)
    path.write_bytes(content[:length])
    self.assertIn("not a readable HDF5 file", self._read_error())

  def test_every_fault_of_the_folder_damaged_first(self):
    for task in ("reach", "lift", "stack"):
      self._write(task)
    (self.folder / "lift.hdf5").write_bytes(b"no")
    self._replace("is_last", np.zeros(2, bool))
    tasks = ("move_object", "stack", "reach", "lift", "bring")
    with self.assertRaises(DatasetError) as caught:
      demonstrations.read_folder(self.folder, tasks, 5, 2)
    lines = str(caught.exception).splitlines()[1:]
    order = [line.partition(": ")[0].rpartition("/")[2] for line in lines]
    self.assertEqual(
      order, ["reach.hdf5", "lift.hdf5", "move_object.hdf5", "bring.hdf5"]
    )
    self.assertEndsWith(lines[-1], "missing")

  def test_no_folder(self):
    with self.assertRaisesRegex(DatasetError, "no dataset folder.*reach.hdf5"):
      demonstrations.read_folder(self.folder / "none", ("reach",))

  def test_summary(self):
    table = demonstration_summary.table({"reach": _DATA})
    header, row = table.splitlines()
    self.assertIn("attempts success median most", header)
    self.assertEqual(row.split()[:6], ["reach", "6", "2", "1", "3", "3"])
