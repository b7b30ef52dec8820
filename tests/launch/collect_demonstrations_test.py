"""The collection command: what it writes, refuses, and leaves behind."""

import os
import pathlib
import signal
import subprocess
import sys
import time

import torch
from absl.testing import absltest

from agents.networks.intentions import IntentionHeads, IntentionNetwork
from agents.networks.trunk import Standardiser, Trunk
from agents.policy import Policy
from launch import command
from lfgp_dmc import demonstrations, task_names

_ROOT = pathlib.Path(command.__file__).resolve().parents[1]
_SCRIPT = str(_ROOT / "launch" / "collect_demonstrations.py")

# Arguments, what the message says.
_BAD = (
  ("--output=new --task=juggle", "--task=juggle is unknown; valid: stack, "),
  ("--output=new --tasks=insert", "--tasks=insert is unknown; valid: stack, "),
  ("--output=new --collection=film", "valid: reset, play"),
  ("--output=new --pairs_per_task=0", "--pairs_per_task=0; valid: 1 or more"),
  ("--output=new --final_pairs=-1", "--final_pairs=-1; valid: 0 or more"),
  (
    "--output=new --attempts_per_task=-1",
    "--attempts_per_task=-1; valid: 0 or more",
  ),
  (
    "--output=new --attempts_per_task=5 --pairs_per_task=9",
    "--attempts_per_task=5 and --pairs_per_task=9; valid: one of the two",
  ),
  (
    "--output=new --attempts_per_task=5 --final_pairs=9",
    "--final_pairs=9; valid: 0 with --attempts_per_task",
  ),
  ("--output=new --longest_of=0", "--longest_of=0; valid: 1 or more"),
  ("--output=new --longest_of=2 --collection=play", "valid: 1 with"),
  ("--output=new --control_hz=7", "--control_hz=7 is unknown; valid: 20, 10"),
  ("--output=new --seed=-1", "--seed=-1; valid: 0 or more"),
  ("--output=new --workers=-1", "--workers=-1; valid: 0 or more"),
  ("--output=new --expert=no/run", "no run folder no/run"),
  ("", "--output is not set"),
  ("--output=old", "--output=old exists; valid: a new folder"),
)


def _start(line: str, folder: str) -> subprocess.Popen:
  return subprocess.Popen(
    [sys.executable, _SCRIPT, *line.split()],
    cwd=folder,
    stdout=subprocess.PIPE,
    stderr=subprocess.PIPE,
    text=True,
    # A shell's background job ignores SIGINT, and so would all it starts.
    preexec_fn=_heed_interrupts,
  )


def _heed_interrupts() -> None:
  signal.signal(signal.SIGINT, signal.SIG_DFL)


class CollectDemonstrationsTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = self.create_tempdir().full_path

  def test_writes_a_checked_file_a_task_and_a_table(self):
    line = "--task=lift --pairs_per_task=12 --seed=3 --output=data/lift"
    line += " --control_hz=5"
    done = _start(line, self.folder)
    output, errors = done.communicate()
    self.assertEqual(done.returncode, 0, errors)
    self.assertRegex(output, r"lift +1 of 1 attempts succeeded \(100.0%\)")
    parent = pathlib.Path(self.folder) / "data"
    self.assertEqual(os.listdir(parent), ["lift"])
    found = demonstrations.read_folder(parent / "lift", ["lift"], 59, 4)
    self.assertLen(found["lift"], 12)
    attributes = dict(found["lift"].attributes)
    del attributes["schema_version"]
    self.assertEqual(
      attributes,
      {
        "task": "lift",
        "main_task": "lift",
        "collection": "reset",
        "expert": "scripted",
        "seed": 3,
        "control_hz": 5,
      },
    )

  def test_bad_input_is_told_in_a_line_and_leaves_nothing(self):
    old = pathlib.Path(self.folder) / "old"
    old.mkdir()
    calls = [_start(line, self.folder) for line, _ in _BAD]
    for (line, message), done in zip(_BAD, calls, strict=True):
      with self.subTest(line):
        _, errors = done.communicate()
        self.assertEqual(done.returncode, 1, errors)
        self.assertIn(message, errors)
        self.assertNotIn("Traceback", errors)
    self.assertEqual(os.listdir(self.folder), ["old"])
    self.assertEmpty(os.listdir(old))

  def test_final_pairs_come_on_top(self):
    line = "--task=reach --pairs_per_task=5 --final_pairs=2 --output=data"
    done = _start(line, self.folder)
    _, errors = done.communicate()
    self.assertEqual(done.returncode, 0, errors)
    path = pathlib.Path(self.folder) / "data" / "reach.hdf5"
    found = demonstrations.read(path, "reach", 59, 4)
    self.assertLen(found, 7)
    self.assertTrue(found.is_last[5:].all())

  def test_a_run_demonstrates_with_sampled_actions(self):
    """A made-up policy that opens, and moves a little at random."""
    generator = torch.Generator().manual_seed(0)
    tasks = task_names.task_set("move_object")
    heads = IntentionHeads(len(tasks), 8, 8, 4, generator)
    with torch.no_grad():
      heads.output.weight.zero_()
      heads.output.bias[:] = torch.tensor([0, 0, 0, -3, -2, -2, -2, -2.0])
    network = IntentionNetwork(
      Standardiser(59), Trunk(59, 8, generator), heads, True
    )
    run = pathlib.Path(self.folder) / "run"
    Policy(network, tasks).save(run, {"main_task": "move_object"})
    line = "--task=open_gripper --pairs_per_task=12 --output=data --expert=run"
    line += " --workers=1"
    opens, stacks = (
      _start(line, self.folder),
      _start("--task=stack --output=new --expert=run", self.folder),
    )
    output, errors = opens.communicate()
    self.assertEqual(opens.returncode, 0, errors)
    self.assertIn("open_gripper", output)
    path = pathlib.Path(self.folder) / "data" / "open_gripper.hdf5"
    found = demonstrations.read(path, "open_gripper", 59, 4)
    self.assertEqual(found.attributes["expert"], "run")
    self.assertTrue((found.action[:, 3] < 0).all())
    self.assertGreater(found.action[:, :3].std(), 0.05)
    _, errors = stacks.communicate()
    self.assertEqual(stacks.returncode, 1)
    self.assertIn(
      "error: --expert=run cannot do stack of --task=stack; it can do: "
      "move_object, open_gripper",
      errors,
    )

  def test_an_interrupt_leaves_nothing(self):
    line = "--task=stack --pairs_per_task=90000 --workers=2 --output=new"
    running = _start(line, self.folder)
    assert running.stderr is not None
    self.assertNotEmpty(running.stderr.read(20))  # the bar: it has begun
    time.sleep(2)
    running.send_signal(signal.SIGINT)
    _, errors = running.communicate(timeout=60)
    self.assertEqual(running.returncode, command.INTERRUPTED, errors)
    self.assertNotIn("Traceback", errors)
    self.assertEmpty(os.listdir(self.folder))


if __name__ == "__main__":
  absltest.main()
