"""The page on own demonstrations, and the command that checks them."""

import contextlib
import os
import re
import shutil

import h5py
import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.data import demonstration_summary, demonstrations
from tests import fixtures
from tests.docs import pages
from tests.launch.fixtures import call

_PAGE = "own_demonstrations.md"


def write_robomimic(path, lengths, goes_on: int = 2) -> None:
  """Attempts that succeed at these lengths, and go on; states count up."""
  with h5py.File(path, "w") as file:
    for index, length in enumerate(lengths):
      steps = length + goes_on
      demo = file.create_group(f"data/demo_{index}")
      count = 100.0 * index + np.arange(steps)
      for part, state in (("obs", count), ("next_obs", count + 1)):
        demo[f"{part}/place"] = np.stack([state, state], axis=1)
        demo[f"{part}/angle"] = -state
      demo["actions"] = np.full((steps, 2), 0.5)
      demo["rewards"] = (np.arange(steps) >= length - 1).astype(float)


class OwnDemonstrationsTest(fixtures.FolderTest):
  """The page's code is run once: it records 20 attempts."""

  @classmethod
  def setUpClass(cls):
    super().setUpClass()
    cls.recorded = fixtures.class_folder(cls)
    with contextlib.chdir(cls.recorded):
      cls.code = pages.run(_PAGE)

  def setUp(self):
    super().setUp()
    shutil.copytree(self.recorded, self.folder, dirs_exist_ok=True)

  def test_a_recording_is_checked_and_learned_from(self):
    _, check, train, *_ = pages.commands(_PAGE)
    if graphics.fault():
      check = check.split(" --strip")[0]
    done = call(check, self.folder)
    self.assertEqual(done.returncode, 0, done.stderr)
    (shown,) = [b for b in pages.blocks(_PAGE, "") if b.startswith("task")]
    header, row, rest = shown.splitlines()  # numbers hang on the machine
    self.assertStartsWith(done.stdout, f"{header}\n{row.split()[0]} ")
    self.assertRegex(done.stdout, rf" 20 +20 .*\n{re.escape(rest)}\n")
    if not graphics.fault():
      self.assertTrue((self.folder / "data/mine.png").exists())
    short = " --config.env_steps=3 --config.evaluation_episodes=1"
    flags = pages.ROOT / "launch/flags"
    train = train.replace("launch/flags", str(flags))
    done = call(train + short, self.folder)
    self.assertEqual(done.returncode, 0, done.stderr)
    act = lfgp_dmc.load_policy(self.folder / "runs/mine")
    self.assertEqual(act(np.zeros(59, np.float32)).shape, (4,))

  def test_robomimics_attempts_end_in_success(self):
    path = self.folder / "robomimic.hdf5"
    write_robomimic(path, (3, 4, *[2] * 9))
    attempts = self.code["robomimic"](path, ("place", "angle"))
    self.code["save"](attempts, self.folder, "mine", 20)
    pairs = demonstrations.read(self.folder / "mine.hdf5", "mine", 3, 2)
    self.assertLen(pairs, 25)
    np.testing.assert_array_equal(pairs.episode[:8], [0, 0, 0, 1, 1, 1, 1, 2])
    np.testing.assert_array_equal(np.flatnonzero(pairs.is_last)[:3], [2, 6, 8])
    self.assertEqual(pairs.observation[3].tolist(), [100, 100, -100])
    self.assertEqual(pairs.next_observation[6].tolist(), [104, 104, -104])
    self.assertEmpty(demonstration_summary.doubts(pairs))

  def test_lerobots_last_frame_can_be_the_success(self):
    columns = {
      "episode_index": np.array([0, 0, 0, 1, 1]),
      "observation.state": list(np.arange(10.0).reshape(5, 2)),
      "action": list(np.full((5, 1), 0.5)),
      "next.done": [[False], [False], [True], [False], [True]],
    }
    attempts = self.code["lerobot"](columns, "next.done")
    pairs = demonstrations.from_attempts(attempts)
    self.assertEqual(pairs.episode.tolist(), [0, 0, 0, 1, 1])
    self.assertEqual(np.flatnonzero(pairs.is_last).tolist(), [2, 4])
    self.assertEqual(pairs.next_observation[1].tolist(), [4, 5])
    self.assertEqual(pairs.next_observation[2].tolist(), [4, 5])

  def test_faults_are_told_in_lines(self):
    folder = self.folder / "data/mine"
    pairs = fixtures.demonstrations(4, 3)
    demonstrations.write(folder / "lift.hdf5", pairs,
                         {**fixtures.ATTRIBUTES, "task": "lift"})  # fmt: skip
    (folder / "stack.hdf5").write_bytes(b"not HDF5")
    (folder / "._reach.hdf5").write_bytes(b"a stray file")
    done = call("check_demonstrations.py --dataset=data/mine", self.folder)
    self.assertEqual(done.returncode, 1)
    self.assertRegex(
      done.stderr,
      r"error: the dataset data/mine cannot be used:\n.*lift.hdf5: "
      r"'observation' has shape \[7, 5\]; valid: \[7, 59\].*\n"
      ".*stack.hdf5: not a readable HDF5 file",
    )
    self.assertNotIn("Traceback", done.stderr)

  def test_files_that_are_missing_or_do_not_go_together(self):
    os.mkdir(self.folder / "empty")
    path = self.folder / "data/mine/lift.hdf5"
    attributes = {**fixtures.ATTRIBUTES, "task": "lift"}
    reach = demonstrations.read(self.folder / "data/mine/reach.hdf5")
    demonstrations.write(path, reach, attributes)
    for line, message in (
      ("--dataset=empty", "no .hdf5 file in empty; it holds: nothing"),
      ("--dataset=empty --task=lift", "lift.hdf5: missing"),
      (
        "--dataset=data/mine --environment=lfgp_dmc.toy:PointEnvironment "
        "--task=right",
        "left.hdf5: missing",
      ),
      ("--dataset=data/mine", "data/mine has several control rates"),
    ):
      with self.subTest(line):
        done = call(f"check_demonstrations.py {line}", self.folder)
        self.assertEqual(done.returncode, 1)
        self.assertIn(message, done.stderr)
        self.assertNotIn("Traceback", done.stderr)


class DoubtsTest(absltest.TestCase):
  def test_what_is_seldom_meant_is_named(self):
    good = fixtures.demonstrations(4, 3)
    self.assertEmpty(demonstration_summary.doubts(good))
    arrays = good.arrays()
    arrays["action"] = arrays["action"] * np.array([1, 0.01], np.float32)
    arrays["is_last"] = np.zeros(7, bool)
    arrays["observation"][2] += 1
    first, second, third = demonstration_summary.doubts(
      demonstrations.Demonstrations(**arrays)
    )
    self.assertIn("no row of success", first)
    self.assertIn("dimension 1", second)
    self.assertIn("1 rows do not start where the row before ended", third)


if __name__ == "__main__":
  absltest.main()
