"""The demonstrations of a run, from several kinds of folders."""

import dataclasses
import pathlib
import shlex
import subprocess
from unittest import mock

import numpy as np

from lfgp_dmc.launch import datasets
from lfgp_dmc.launch.command import UserError
from tests.launch import fixtures


def _stack(dataset, **changes):
  return fixtures.small_config(
    dataset, environment="", main_task="stack", **changes
  )


class DatasetsTest(fixtures.RunTest):
  def test_mirror_images_double_what_was_shown(self):
    dataset = fixtures.write_dataset(
      self.folder / "shown", ("stack", "move_object"), 59, 4, pairs=20
    )
    for mirror, pairs in ((False, 15), (True, 30)):
      config = _stack(dataset, mirror_demonstrations=mirror, pairs_per_task=15)
      shown = datasets.load(config, ["stack", "move_object"], (59, 4))
      self.assertLen(shown["stack"], pairs)
      self.assertLen(shown["move_object"], 15)

  def test_attempts_are_copied_elsewhere_after_their_images(self):
    dataset = fixtures.write_dataset(
      self.folder / "shown", ("stack", "bring"), 59, 4, pairs=20
    )
    config = _stack(
      dataset, mirror_demonstrations=True, shifted_copies=2, attempts_per_task=1
    )
    shown, again = (
      datasets.load(config, ["stack", "bring"], (59, 4)) for _ in range(2)
    )
    self.assertEqual(shown["stack"].attempts, 6)
    self.assertEqual(shown["bring"].attempts, 2)
    np.testing.assert_array_equal(
      shown["stack"].observation, again["stack"].observation
    )
    other = datasets.load(
      dataclasses.replace(config, seed=1), ["stack"], (59, 4)
    )
    self.assertFalse(
      np.array_equal(other["stack"].observation, shown["stack"].observation)
    )

  def test_collects_into_a_folder_with_blanks(self):
    folder = self.folder / "it's mine; really"
    config = self.config(
      demonstrations=str(folder), collect_missing=True, pairs_per_task=30,
      environment="", main_task="lift", seed=3, control_hz=10,
    )  # fmt: skip
    with (
      mock.patch.object(subprocess, "Popen") as popen,
      mock.patch("builtins.print") as printed,
    ):
      process = popen.return_value.__enter__.return_value
      process.wait.return_value = 1
      with self.assertRaisesRegex(UserError, "could not be collected"):
        datasets.load(config, ["lift"], (59, 4))
      process.wait.side_effect = [KeyboardInterrupt, 130]
      with self.assertRaises(KeyboardInterrupt):
        datasets.load(config, ["lift"], (59, 4))
      process.terminate.assert_called_once()  # and not killed
    self.assertContainsSubset(
      ["--task=lift", "--pairs_per_task=30", "--seed=3", "--control_hz=10",
       f"--output={folder}"],
      popen.call_args.args[0],
    )  # fmt: skip
    shown = shlex.split(printed.call_args.args[0].partition(": ")[2])
    self.assertEqual(shown[2:], popen.call_args.args[0][2:])

  def test_what_another_run_collected_meanwhile_is_used(self):
    folder = self.folder / "meanwhile"
    config = _stack(
      folder, collect_missing=True, pairs_per_task=30, algorithm="dac"
    )

    def wait():  # until the command refuses the folder that is there by now
      fixtures.write_dataset(folder, ["stack"], 59, 4)
      return 1

    with mock.patch.object(subprocess, "Popen") as popen:
      popen.return_value.__enter__.return_value.wait.side_effect = wait
      found = datasets.load(config, ["stack"], (59, 4))
    self.assertLen(found["stack"], 30)

  def test_published_examples_are_read_like_a_dataset(self):
    data = pathlib.Path(__file__).parents[1] / "data"
    folder = self.folder / "examples"
    folder.mkdir()
    with np.load(data / "published_lift.npz", allow_pickle=False) as part:
      rows = {name: part[name][:50] for name in part.files}
    rows["observation"] = rows["next_observation"]
    np.savez(folder / "lift.npz", **rows)
    config = self.config(demonstrations=str(folder))
    shown = datasets.load(config, ["lift"], (59, 4))
    self.assertLen(shown["lift"], 50)
    with self.assertRaisesRegex(UserError, "stack.npz: missing"):
      datasets.load(config, ["lift", "stack"], (59, 4))
    (folder / "reach.hdf5").touch()  # files of ours count alone
    with self.assertRaisesRegex(UserError, "lift.hdf5: missing"):
      datasets.load(config, ["lift", "stack"], (59, 4))
