"""The collection command: what it writes, refuses, and leaves behind."""

import os
import pathlib
import signal
import subprocess
import sys
import time

from absl.testing import absltest

from launch import command
from lfgp_dmc import demonstrations

_ROOT = pathlib.Path(command.__file__).resolve().parents[1]
_SCRIPT = str(_ROOT / "launch" / "collect_demonstrations.py")

# Arguments, what the message says.
_BAD = (
  ("--output=new --task=juggle", "--task=juggle is unknown; valid: stack, "),
  ("--output=new --tasks=insert", "--tasks=insert is unknown; valid: stack, "),
  ("--output=new --collection=film", "valid: reset, play"),
  ("--output=new --pairs_per_task=0", "--pairs_per_task=0; valid: 1 or more"),
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
  )


class CollectDemonstrationsTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = self.create_tempdir().full_path

  def test_writes_a_checked_file_a_task_and_a_table(self):
    line = "--task=lift --pairs_per_task=25 --seed=3 --output=data/lift"
    done = _start(line, self.folder)
    output, errors = done.communicate()
    self.assertEqual(done.returncode, 0, errors)
    self.assertRegex(output, r"lift +1 of 1 attempts succeeded \(100.0%\)")
    parent = pathlib.Path(self.folder) / "data"
    self.assertEqual(os.listdir(parent), ["lift"])
    found = demonstrations.read_folder(parent / "lift", ["lift"], 59, 4)
    self.assertLen(found["lift"], 25)
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
        "control_hz": 20,
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
