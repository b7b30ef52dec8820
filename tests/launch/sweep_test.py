"""Sweeps: which runs there are, and how they come to their end."""

import importlib.util
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

from absl.testing import absltest

from lfgp_dmc.data import csv_files
from lfgp_dmc.launch import command, sweep, sweep_jobs
from tests.launch import fixtures

_SCRIPT = pathlib.Path(command.__file__).with_name("sweep.py")


class FakeEngine:
  """Ends every run at once, by the exit statuses that it was given."""

  slots = 2

  def __init__(self, statuses):
    self.statuses = {name: list(ends) for name, ends in statuses.items()}
    self.started, self._over, self.most = [], {}, 0

  def start(self, name, arguments, log):
    self.started.append(name)
    status = self.statuses.get(name, [0]).pop(0)
    self._over[name] = status
    self.most = max(self.most, len(self._over))
    text = "error: bad input\n" if status == 1 else "Killed\n"
    log.write_text(text if status else "")

  def ended(self):
    over, self._over = self._over, {}
    return over


class SweepTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)
    self.flags = self.folder / "flags"
    self.flags.mkdir()
    for stem in ("lfgp_stack", "lfgp_bring", "lfgp_transfer_stack",
                 "lfgp_move_object"):  # fmt: skip
      (self.flags / f"{stem}.flags").touch()

  def _jobs(self, algorithms, seeds=(0,), starts=(), arguments=()):
    jobs = sweep_jobs.make_jobs(
      algorithms,
      ("stack", "bring"),
      seeds,
      self.folder,
      arguments,
      self.flags,
    )
    sweep_jobs.chain(jobs, starts)
    return jobs

  def _run(self, jobs, engine, restarts=1):
    sweep.Sweep(jobs, self.folder / "index.csv", restarts).run(engine)
    return {job.name: job.state for job in jobs}

  def test_names_runs_after_flagfiles_and_seeds(self):
    jobs = self._jobs(("lfgp", "dac", "lfgp_move_object"), (0, 7),
                      arguments=["--x={runs}/{seed}"])  # fmt: skip
    names = [job.name for job in jobs]
    self.assertLen(names, 2 * 5)
    self.assertIn("lfgp_move_object_7", names)
    states = {job.name: job.state for job in jobs}
    self.assertEqual(states["dac_stack_0"], "no flagfile")
    self.assertEqual(states["lfgp_stack_0"], "waiting")
    self.assertContainsSubset(
      ["--config.seed=7", f"--x={self.folder}/7",
       f"--run={self.folder}/lfgp_stack_7"],
      jobs[names.index("lfgp_stack_7")].train_arguments(),
    )  # fmt: skip

  def test_what_died_is_tried_again_and_bad_input_is_not(self):
    jobs = self._jobs(("lfgp", "dac"), (0, 1))
    engine = FakeEngine(
      {"lfgp_stack_0": [-9, 0], "lfgp_bring_0": [1], "lfgp_stack_1": [-9, -9]}
    )
    states = self._run(jobs, engine)
    self.assertEqual(
      states,
      {
        "lfgp_stack_0": "done",
        "lfgp_bring_0": "failed",
        "lfgp_stack_1": "failed",
        "lfgp_bring_1": "done",
        "dac_stack_0": "no flagfile",
        "dac_bring_0": "no flagfile",
        "dac_stack_1": "no flagfile",
        "dac_bring_1": "no flagfile",
      },
    )
    self.assertEqual(engine.most, 2)
    _, rows = csv_files.read(self.folder / "index.csv")
    by_name = {row["name"]: row for row in rows}
    self.assertEqual(by_name["lfgp_stack_0"]["attempts"], "2")
    self.assertEqual(by_name["lfgp_bring_0"]["message"], "error: bad input")
    self.assertEqual(by_name["lfgp_stack_1"]["message"],
                     "killed by SIGKILL")  # fmt: skip

  def test_a_transfer_waits_for_its_source(self):
    start = "lfgp_transfer_stack:lfgp_move_object:config.from"
    algorithms = ("lfgp_transfer", "lfgp_move_object")
    jobs = self._jobs(algorithms, (0, 1), [start])
    self.assertIn(
      f"--config.from={self.folder}/lfgp_move_object_1",
      next(j for j in jobs if j.name == "lfgp_transfer_stack_1").arguments,
    )
    engine = FakeEngine({"lfgp_move_object_1": [1]})
    states = self._run(jobs, engine)
    self.assertEqual(states["lfgp_transfer_stack_0"], "done")
    self.assertEqual(states["lfgp_transfer_stack_1"], "held")
    self.assertLess(engine.started.index("lfgp_move_object_0"),
                    engine.started.index("lfgp_transfer_stack_0"))  # fmt: skip
    (alone, _) = self._jobs(("lfgp_transfer",), (0,), [start])
    self.assertEqual(alone.state, "held")
    with self.assertRaisesRegex(ValueError, "valid: TARGET:SOURCE"):
      self._jobs(("lfgp",), starts=["lfgp_stack"])

  def test_knows_what_is_done_by_index_or_evaluation(self):
    jobs = self._jobs(("lfgp",), (0, 1))
    for job in jobs:
      job.folder.mkdir()
      config = {"main_task": job.main_task, "env_steps": 100}
      (job.folder / "config.json").write_text(json.dumps(config))
    for job, step in ((jobs[0], 50), (jobs[1], 100)):
      (job.folder / "evaluation.csv").write_text(
        "env_step,task,episode,seed,success,steps_to_success,return\n"
        f"{step},{job.main_task},0,0,1,9,1.0\n"
      )
    jobs[2].state, jobs[2].wall_s = "done", 60
    index = self.folder / "index.csv"
    sweep_jobs.write_index(jobs, index)
    again = self._jobs(("lfgp",), (0, 1))
    sweep_jobs.recall(again, index)
    self.assertEqual(
      [job.state for job in again], ["waiting", "done", "done", "waiting"]
    )
    self.assertEqual(again[2].wall_s, 60)
    self.assertIn("--resume", again[0].train_arguments())
    row = csv_files.read(index)[1][0]
    self.assertEqual((row["env_step"], row["success"]), ("50", "1.000"))


class CommandTest(absltest.TestCase):
  """The command itself, on the toy environment."""

  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)
    dataset = fixtures.write_dataset(self.folder / "data")
    flags = self.folder / "flags"
    flags.mkdir()
    lines = [
      "--config.algorithm=lfgp",
      f"--config.demonstrations={dataset}",
      f"--config.environment={fixtures.POINT}",
      "--config.main_task=right",
      "--config.agent.batch_size=8",
      "--config.agent.discriminator_batch_size=8",
      "--config.agent.hidden_size=16",
      "--config.agent.episode_steps=20",
      "--config.agent.warm_up=20",
      "--config.agent.xi=5",
      "--config.checkpoint_every=40",
      "--config.env_steps=3000",
      "--config.agent.updates_per_step=0.1",
      "--config.evaluate_every=3000",
      "--config.evaluation_episodes=2",
      "--config.evaluation_workers=1",
      "--config.replay_capacity=100000",
    ]
    (flags / "lfgp_toy.flags").write_text("\n".join(lines))

  def _start(self, *arguments) -> subprocess.Popen:
    return subprocess.Popen(
      [
        sys.executable,
        _SCRIPT,
        "--flagfiles=flags",
        "--main_tasks=toy",
        "--runs=runs",
        "--seeds=0",
        "--workers=1",
        *arguments,
      ],
      cwd=self.folder,
      stdout=subprocess.PIPE,
      stderr=subprocess.PIPE,
      text=True,
    )

  def _call(self, *arguments) -> subprocess.CompletedProcess:
    running = self._start(*arguments)
    output, errors = running.communicate(timeout=120)
    return subprocess.CompletedProcess([], running.returncode, output, errors)

  def _index(self) -> dict[str, dict[str, str]]:
    rows = csv_files.read(self.folder / "runs" / "index.csv")[1]
    return {row["name"]: row for row in rows}

  def test_stops_with_a_checkpoint_goes_on_and_then_skips(self):
    listed = self._call("--algorithms=lfgp,dac", "--dry_run")
    self.assertIn("2 runs: 1 waiting, 1 no flagfile", listed.stdout)
    self.assertFalse((self.folder / "runs").exists())
    running = self._start("--algorithms=lfgp,dac")
    run = self.folder / "runs" / "lfgp_toy_0"
    log = run.with_name("lfgp_toy_0.log")
    _wait_for((run / "metrics.csv").exists)
    running.send_signal(signal.SIGINT)
    _, errors = running.communicate(timeout=60)
    self.assertEqual(running.returncode, command.INTERRUPTED, errors)
    row = self._index()["lfgp_toy_0"]
    self.assertEqual(row["state"], "stopped")
    self.assertGreater(float(row["wall_s"]), 0)
    self.assertNotEmpty(os.listdir(run / "checkpoints"))
    self.assertIn("stopped at", log.read_text())
    done = self._call()
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("success after 3000", log.read_text())
    row = self._index()["lfgp_toy_0"]
    self.assertEqual((row["state"], row["env_step"]), ("done", "3000"))
    self.assertNotEmpty(row["success"])
    again = self._call()
    self.assertEqual(again.returncode, 0)
    self.assertNotIn("started", again.stdout)

  def test_bad_input_is_told(self):
    for arguments, message in (
      (["--seeds=a"], "--seeds: invalid literal"),
      (["--algorithms=sorcery"], "none of these runs has a flagfile"),
      (["--start_from=a"], "valid: TARGET:SOURCE"),
    ):
      done = self._call(*arguments)
      self.assertEqual(done.returncode, 1)
      self.assertIn(message, done.stderr)
      self.assertNotIn("Traceback", done.stderr)

  def test_trains_on_a_local_ray(self):
    if not importlib.util.find_spec("ray"):
      self.skipTest("the extra ray is not installed")
    done = self._call("--engine=ray", "--train=--config.env_steps=60")
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertEqual(self._index()["lfgp_toy_0"]["state"], "done")


def _wait_for(condition, seconds: float = 60) -> None:
  end = time.monotonic() + seconds
  while not condition():
    assert time.monotonic() < end, "waited too long"
    time.sleep(0.1)


if __name__ == "__main__":
  absltest.main()
