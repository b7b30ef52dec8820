"""The sweep command itself, on the toy environment."""

import os
import signal
import subprocess

from lfgp_dmc.launch import command
from tests.fixtures import FolderTest
from tests.launch import sweep_fixtures


class SweepCommandTest(FolderTest):
  def setUp(self):
    super().setUp()
    sweep_fixtures.write_flagfiles(self.folder, lfgp=3000)

  def _start(self, *arguments) -> subprocess.Popen:
    return sweep_fixtures.start(
      self.folder, "--seeds=0", "--workers=1", *arguments
    )

  def _call(self, *arguments) -> subprocess.CompletedProcess:
    running = self._start(*arguments)
    output, errors = running.communicate(timeout=120)
    return subprocess.CompletedProcess([], running.returncode, output, errors)

  def test_stops_with_a_checkpoint_goes_on_and_then_skips(self):
    listed = self._call("--algorithms=lfgp,dac", "--dry_run")
    self.assertIn("2 runs: 1 waiting, 1 no flagfile", listed.stdout)
    self.assertFalse((self.folder / "runs").exists())
    refused = self._call("--algorithms=lfgp,dac")
    self.assertEqual(refused.returncode, 1)
    self.assertIn("flags/dac.flags; see --dry_run", refused.stderr)
    running = self._start()
    run = self.folder / "runs" / "lfgp_right_0"
    log = run.with_name("lfgp_right_0.log")
    sweep_fixtures.wait_for((run / "metrics.csv").exists)
    running.send_signal(signal.SIGINT)
    _, errors = running.communicate(timeout=60)
    self.assertEqual(running.returncode, command.INTERRUPTED, errors)
    row = sweep_fixtures.index(self.folder)["lfgp_right_0"]
    self.assertEqual(row["state"], "stopped")
    self.assertGreater(float(row["wall_s"]), 0)
    self.assertNotEmpty(os.listdir(run / "checkpoints"))
    self.assertIn("stopped at", log.read_text())
    done = self._call()
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("success after 3000", log.read_text())
    self.assertTrue((run / "learning_curve.png").exists())
    row = sweep_fixtures.index(self.folder)["lfgp_right_0"]
    self.assertEqual((row["state"], row["env_step"]), ("done", "3000"))
    self.assertNotEmpty(row["success"])
    again = self._call()
    self.assertEqual(again.returncode, 0)
    self.assertNotIn("started", again.stdout)
