"""Signals to whole jobs: every process gets them, often twice."""

import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import time

from absl.testing import parameterized

from lfgp_dmc.launch import command
from tests import fixtures as shared
from tests.launch import fixtures, sweep_fixtures

_LAUNCH = pathlib.Path(command.__file__).parent


class SignalsTest(shared.FolderTest, parameterized.TestCase):
  def _start(self, line: str) -> subprocess.Popen:
    script, *arguments = line.split()
    running = subprocess.Popen(
      [sys.executable, str(_LAUNCH / script), *arguments],
      cwd=self.folder,
      stdout=subprocess.DEVNULL,
      stderr=subprocess.PIPE,
      text=True,
      start_new_session=True,
    )
    self.addCleanup(self._clear, running)
    return running

  def _clear(self, running):
    if self._members(running):
      os.killpg(running.pid, signal.SIGKILL)
    running.wait()

  def _members(self, running) -> list[int]:
    """The processes of a command's group."""
    members = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
      with contextlib.suppress(OSError):  # it has ended
        state, _, group = path.read_text().rpartition(")")[2].split()[:3]
        if int(group) == running.pid and state != "Z":
          members.append(int(path.parent.name))
    return sorted(members)

  def _finish(self, running, seconds: float) -> str:
    """What it says, if it ends in time by itself and leaves no process."""
    start = time.monotonic()
    _, errors = running.communicate(timeout=60)
    self.assertLess(time.monotonic() - start, seconds)
    self.assertEqual(running.returncode, command.INTERRUPTED, errors)
    self.assertNotIn("Traceback", errors)
    self.assertNotIn("Exception ignored", errors)
    # Python's own tracker ends by itself, moments after.
    sweep_fixtures.wait_for(lambda: not self._members(running), seconds=2)
    return errors

  @parameterized.parameters(
    ("evaluate.py --expert=scripted --tasks=stack --episodes=500", "SIGINT"),
    ("collect_demonstrations.py --task=stack --output=new", "SIGTERM"),
  )
  def test_two_at_once_end_a_command_with_workers(self, line, name):
    running = self._start(f"{line} --workers=2")
    number = signal.Signals[name]
    sweep_fixtures.wait_for(lambda: len(self._members(running)) >= 4)
    os.killpg(running.pid, number)
    time.sleep(0.05)
    os.killpg(running.pid, number)
    errors = self._finish(running, 10)  # two seconds where nothing else runs
    self.assertEqual(errors.split(), ["interrupted"])
    self.assertEmpty(os.listdir(self.folder))

  def test_a_killed_worker_is_a_line_with_the_flag(self):
    running = self._start(
      "evaluate.py --expert=scripted --episodes=500 --workers=2"
    )
    sweep_fixtures.wait_for(lambda: len(self._members(running)) >= 4)
    os.kill(self._members(running)[-1], signal.SIGKILL)
    _, errors = running.communicate(timeout=60)
    self.assertEqual(running.returncode, 1)
    self.assertIn("error: a worker process was killed by SIGKILL", errors)
    self.assertIn("--workers=1", errors)
    self.assertLen(errors.splitlines(), 1)

  def test_a_training_whose_group_is_stopped_in_an_evaluation_goes_on(self):
    fixtures.write_dataset(self.folder / "data")
    line = (
      "train.py --config.algorithm=lfgp --config.demonstrations=data "
      f"--config.environment={fixtures.POINT} --config.main_task=right "
      "--config.agent.batch_size=8 --config.agent.networks.hidden_size=16 "
      "--config.agent.reward.batch_size=8 --config.agent.scheduler.xi=5 "
      "--config.episode_steps=20 --config.env_steps=40 --config.warm_up=20 "
      "--config.evaluate_first --config.evaluation_episodes=20 "
      "--config.evaluation_workers=2 --config.replay_capacity=200 --run=a"
    )
    running = self._start(line)
    sweep_fixtures.wait_for(lambda: len(self._members(running)) >= 4)
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGTERM):
      os.killpg(running.pid, number)
    self._finish(running, 30)
    self.assertLen(os.listdir(self.folder / "a" / "checkpoints"), 1)
    again = "train.py --run=a --resume --config.evaluation_workers=1"
    done = fixtures.call(again, self.folder)
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("success after 40", done.stdout)
