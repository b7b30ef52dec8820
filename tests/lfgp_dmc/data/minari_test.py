"""Demonstrations to Minari and back."""

import importlib.util
import os
import unittest
from unittest import mock

import numpy as np
from absl.testing import parameterized

from lfgp_dmc.data import demonstrations

if not importlib.util.find_spec("minari"):
  raise unittest.SkipTest("the extra minari is not installed")

import gymnasium
import h5py
import minari
from minari import data_collector

from lfgp_dmc.data import minari_datasets
from tests import fixtures
from tests.launch import fixtures as launch_fixtures


class MinariTest(fixtures.FolderTest):
  def setUp(self):
    super().setUp()
    self.enter_context(
      mock.patch.dict(
        os.environ, {"MINARI_DATASETS_PATH": str(self.folder / "minari")}
      )
    )

  def test_comes_back_as_it_went(self):
    data = fixtures.demonstrations(4, 1, 6)
    minari_datasets.to_minari({"lfgp_dmc/a/reach-v0": data})
    stored = minari.load_dataset("lfgp_dmc/a/reach-v0")
    self.assertEqual((stored.total_episodes, stored.total_steps), (3, 11))
    first, _, last = list(minari.load_dataset("lfgp_dmc/a/reach-v0"))
    self.assertEqual(first.observations.shape, (5, 5))
    self.assertTrue(first.terminations[-1])
    self.assertTrue(last.truncations[-1])
    back = minari_datasets.from_minari("lfgp_dmc/a/reach-v0")
    for name, array in data.arrays().items():
      np.testing.assert_array_equal(back.arrays()[name], array, name)
      self.assertEqual(back.arrays()[name].dtype, array.dtype)
    self.assertEqual(back.attributes, fixtures.ATTRIBUTES)
    demonstrations.write(self.folder / "reach.hdf5", back)
    with self.assertRaisesRegex(ValueError, "exists; choose another"):
      minari_datasets.to_minari({"lfgp_dmc/a/reach-v0": data})
    minari_datasets.to_minari({"lfgp_dmc/a/lift-v0": data})
    self.assertLen(minari.list_local_datasets(), 2)
    with self.assertRaisesRegex(ValueError, "exists; choose another"):
      minari_datasets.to_minari({"lfgp_dmc/a/reach-v0/lift-v0": data})

  @parameterized.parameters(
    "my lab/reach-v0", "ab/reach", "ab/rea ch-v0", "/reach-v0", "../reach-v0",
    "a//reach-v0", "", "ab/.reach-v0", "/tmp/ab/reach-v0", "reach-v0/",
  )  # fmt: skip
  def test_a_bad_name_leaves_the_store_as_it_was(self, name):
    data = fixtures.demonstrations(4, 1)
    with self.assertRaisesRegex(ValueError, "is no name of Minari"):
      minari_datasets.to_minari({"ab/lift-v0": data, name: data})
    self.assertEmpty(minari.list_local_datasets())
    self.assertEmpty(os.listdir(self.folder / "minari"))

  def test_a_failure_midway_leaves_the_store_as_it_was(self):
    data = fixtures.demonstrations(4, 1)
    with (
      mock.patch.object(
        minari_datasets.json, "dumps", side_effect=["{}", OSError("full")]
      ),
      self.assertRaisesRegex(OSError, "full"),
    ):
      minari_datasets.to_minari({"ab/lift-v0": data, "ab/reach-v0": data})
    self.assertEmpty(os.listdir(self.folder / "minari"))
    self.assertEqual(
      os.environ["MINARI_DATASETS_PATH"], str(self.folder / "minari")
    )

  def test_a_folder_of_data_beside_the_store_is_none_of_it(self):
    (self.folder / "data").mkdir()
    data = fixtures.demonstrations(4, 1)
    minari_datasets.to_minari({"ab/lift-v0": data})
    self.assertLen(minari.list_local_datasets(), 1)

  @parameterized.parameters("half a file", "no actions")
  def test_a_damaged_dataset_is_named(self, damage):
    minari_datasets.to_minari({"ab/lift-v0": fixtures.demonstrations(4, 1)})
    stored = self.folder / "minari/ab/lift-v0/data/main_data.hdf5"
    if damage == "no actions":
      with h5py.File(stored, "a") as file:
        del file["episode_0/actions"]
    else:
      stored.write_bytes(stored.read_bytes()[:3000])
    with self.assertRaisesRegex(ValueError, "ab/lift-v0 is damaged or unfin"):
      minari_datasets.from_minari("ab/lift-v0")

  def test_what_does_not_fit_is_named(self):
    data = fixtures.demonstrations(4, 1, 6)
    data.observation[2] += 1
    with self.assertRaisesRegex(ValueError, "row 2 does not start where"):
      minari_datasets.to_minari({"a-v0": data})
    with self.assertRaisesRegex(ValueError, "no local Minari dataset a-v0"):
      minari_datasets.from_minari("a-v0")
    buffer = data_collector.EpisodeBuffer(
      observations=np.zeros(3, np.int64),
      actions=np.zeros((2, 1), np.float32),
      rewards=[0, 0],
      terminations=[False, True],
      truncations=[False, False],
    )
    minari.create_dataset_from_buffers(
      "b-v0",
      [buffer],
      observation_space=gymnasium.spaces.Discrete(4),
      action_space=gymnasium.spaces.Box(-1, 1, (1,)),
      description="Not ours.",
    )
    with self.assertRaisesRegex(ValueError, "is Discrete.*valid: a flat Box"):
      minari_datasets.from_minari("b-v0")

  def test_the_command_converts_folders(self):
    ours = self.folder / "ours"
    ours.mkdir()
    demonstrations.write(ours / "reach.hdf5", fixtures.demonstrations(4, 1, 6))
    (ours / "._reach.hdf5").write_bytes(b"of another system")
    (ours / ".lift.99.partial.hdf5").write_bytes(b"of a killed process")
    (ours / "stack.hdf5").write_bytes(b"damaged")
    line = "convert_minari.py --minari=lfgp_dmc/b --dataset=ours"
    done = launch_fixtures.call(line, self.folder)
    self.assertEqual(done.returncode, 1)
    self.assertRegex(done.stderr, r"\Aerror: ours/stack.hdf5: not .*\n\Z")
    (ours / "stack.hdf5").unlink()
    for arguments, said in (
      ("--dataset=ours", "lfgp_dmc/b/reach-v0"),
      (
        "--dataset=new --back --attributes=expert=me,seed=9,control_hz=12.5",
        "new/reach.hdf5",
      ),
    ):
      line = f"convert_minari.py --minari=lfgp_dmc/b {arguments}"
      done = launch_fixtures.call(line, self.folder)
      self.assertEqual(done.returncode, 0, done.stderr)
      self.assertIn(said, done.stdout)
    back = demonstrations.read(self.folder / "new" / "reach.hdf5", "reach")
    self.assertLen(back, 11)
    found = [back.attributes[k] for k in ("expert", "seed", "control_hz")]
    self.assertEqual(found, ["me", 9, 12.5])
    done = launch_fixtures.call(f"{line},seed=x", self.folder)
    self.assertIn("--attributes=seed=x: invalid literal", done.stderr)
