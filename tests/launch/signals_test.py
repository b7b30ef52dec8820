"""Signals to whole jobs: every process gets them, often twice."""

import contextlib
import io
import os
import pathlib
import signal
import subprocess
import sys
import time

from absl.testing import parameterized

from lfgp_dmc.acting import workers
from lfgp_dmc.launch import command
from tests import fixtures as shared
from tests.launch import fixtures, sweep_fixtures

_LAUNCH = pathlib.Path(command.__file__).parent


class SignalsTest(shared.FolderTest):
  def _start(self, line: str) -> subprocess.Popen:
    """Starts a command of three processes, and waits until all are there."""
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
    # The fourth is Python's own tracker.
    sweep_fixtures.wait_for(lambda: len(self._members(running)) >= 4)
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
    return members

  def _finish(self, running) -> str:
    """What it says; it must end by itself and leave no process."""
    _, errors = running.communicate(timeout=60)
    self.assertEqual(running.returncode, command.INTERRUPTED, errors)
    self.assertNotIn("Traceback", errors)
    self.assertNotIn("Exception ignored", errors)
    sweep_fixtures.wait_for(lambda: not self._members(running))
    return errors

  @parameterized.parameters(
    ("evaluate.py --expert=scripted --tasks=stack --episodes=500", "SIGINT"),
    ("collect_demonstrations.py --task=stack --output=new", "SIGTERM"),
  )
  def test_two_at_once_end_a_command_with_workers(self, line, name):
    running = self._start(f"{line} --workers=2")
    for _ in range(2):
      os.killpg(running.pid, signal.Signals[name])
      time.sleep(0.05)
    self.assertEqual(self._finish(running).split(), ["interrupted"])
    self.assertEmpty(os.listdir(self.folder))

  def test_a_training_whose_group_is_stopped_in_an_evaluation_goes_on(self):
    fixtures.write_dataset(self.folder / "data")
    line = (
      "train.py --config.algorithm=lfgp --config.demonstrations=data "
      f"--config.environment={fixtures.POINT} --config.main_task=right "
      "--config.agent.batch_size=8 --config.agent.networks.hidden_size=16 "
      "--config.agent.reward.batch_size=8 --config.agent.scheduler.xi=5 "
      "--config.episode_steps=20 --config.env_steps=40 --config.warm_up=20 "
      "--config.evaluate_first --config.evaluation_episodes=2 "
      "--config.evaluation_workers=2 --config.replay_capacity=200 --run=a"
    )
    running = self._start(line)
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGTERM):
      os.killpg(running.pid, number)
    self._finish(running)
    self.assertLen(os.listdir(self.folder / "a" / "checkpoints"), 1)
    done = fixtures.call("train.py --run=a --resume", self.folder)
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("success after 40", done.stdout)
    self.assertNotIn("nothing was learned", done.stdout)

  def test_a_lost_worker_is_a_line_with_the_flag(self):
    def lose():
      raise workers.LostWorkerError("a worker process was killed")

    with contextlib.redirect_stderr(io.StringIO()) as errors:
      self.assertEqual(command.guarded(lose), 1)
    self.assertRegex(errors.getvalue(), "^error: a worker .*: --.*workers=1\n$")
