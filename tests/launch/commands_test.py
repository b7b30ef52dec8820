"""The commands as users call them: bad input, and a run from end to end."""

import json
import pathlib
import shutil
import subprocess

import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc import graphics, task_names
from lfgp_dmc.data import csv_files, evaluation_csv
from lfgp_dmc.launch import command, policies, training
from lfgp_dmc.pictures import video
from tests.fixtures import FolderTest, class_folder
from tests.launch import fixtures

_ROOT = pathlib.Path(command.__file__).resolve().parents[1]


class DemoTest(FolderTest):
  def test_collects_trains_and_leaves_table_figure_and_video(self):
    flagfile = _ROOT / "launch" / "flags" / "quickstart.flags"
    stored = _ROOT / "results" / "policies" / "stack"
    done = fixtures.call(
      f"demo.py --flagfile={flagfile} --run=runs/demo --height=64 --width=64 "
      f"--stored={stored} --config.main_task=open_gripper "
      "--config.attempts_per_task=3 --config.env_steps=360 "
      "--config.warm_up=200 --config.agent.scheduler.kind=weighted_random "
      "--config.evaluate_every=360 --config.evaluation_episodes=1 "
      "--config.evaluation_workers=1 --config.agent.batch_size=8 "
      "--bc_updates=5",
      self.folder,
      fresh=True,
    )
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertRegex(
      done.stdout,
      r"task +untrained +BC +trained +stored +expert\nopen_gripper",
    )
    self.assertIn("total time", done.stdout)
    self.assertTrue((self.folder / "runs/demo/learning_curve.png").exists())
    if not graphics.fault():
      self.assertTrue((self.folder / "runs/demo/video.mp4").exists())


class ShortRunTest(FolderTest):
  def test_says_that_no_update_was_made(self):
    fixtures.write_dataset(self.folder / "data")
    done = fixtures.call(
      "train.py --config.algorithm=lfgp --config.demonstrations=data "
      f"--config.environment={fixtures.POINT} --config.main_task=right "
      "--config.agent.networks.hidden_size=16 --config.episode_steps=20 "
      "--config.env_steps=40 --config.warm_up=50 --config.replay_capacity=200 "
      "--config.evaluation_episodes=1 --config.evaluation_workers=1 --run=a",
      self.folder,
    )
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("nothing was learned: config.warm_up=50", done.stdout)


class BlockRunTest(absltest.TestCase):
  """A tiny run of the block tasks, made once, and what is done with it."""

  @classmethod
  def setUpClass(cls):
    super().setUpClass()
    cls.folder = class_folder(cls)
    dataset = fixtures.write_dataset(
      cls.folder / "data", task_names.task_set("bring"), 59, 4
    )
    changes = {
      "episode_steps": 0,
      "warm_up": 300,
      "agent.scheduler.xi": 45,
      "env_steps": 400,
      "environment": "",
      "evaluate_every": 400,
      "evaluation_episodes": 1,
      "main_task": "bring",
      "replay_capacity": 400,
    }
    cls.path = cls.folder / "runs" / "tiny"
    config = fixtures.small_config(dataset, **changes)
    training.train(config, cls.path, progress_bar=False)

  def _call(self, line: str) -> subprocess.CompletedProcess:
    return fixtures.call(line, self.folder)

  def test_a_bare_resume_takes_the_runs_own_config(self):
    done = self._call("train.py --run=runs/tiny --resume")
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("success after 400 environment steps", done.stdout)
    self.assertIn("the run was at its end already, at 400", done.stdout)
    self.assertIn("policy       runs/tiny/policy.safetensors", done.stdout)
    self.assertTrue((self.path / "learning_curve.png").exists())

  def test_evaluates_the_run_and_refuses_to_overwrite(self):
    line = "evaluate.py --run=runs/tiny --episodes=2 --workers=1 --output=out"
    done = self._call(line)
    self.assertEqual(done.returncode, 0, done.stderr)
    rows = evaluation_csv.read_csv(self.folder / "out" / "evaluation.csv")
    self.assertLen(rows, 2)
    self.assertEqual({row.env_step for row in rows}, {400})
    # Training evaluated the same reset with the same policy.
    first = evaluation_csv.read_csv(self.path / "evaluation.csv")[0]
    self.assertEqual(rows[0], first)
    done = self._call(line)
    self.assertEqual(done.returncode, 1)
    self.assertIn("exists; choose another --output", done.stderr)

  def test_evaluating_a_policy_folder_leaves_it_as_it_is(self):
    stored = self.folder / "stored"
    stored.mkdir()
    for name in ("config.json", "policy.safetensors"):
      shutil.copy(self.path / name, stored)
    done = self._call("evaluate.py --run=stored --episodes=1 --workers=1")
    self.assertRegex(done.stdout, r"bring .*\n\Z")
    self.assertLen(list(stored.iterdir()), 2)

  def test_evaluates_the_last_checkpoints_each_on_its_own_resets(self):
    line = "evaluate.py --run=runs/tiny --episodes=1 --workers=1 --seed=3 "
    done = self._call(f"{line} --checkpoints=2 --output=ends")
    self.assertEqual(done.returncode, 0, done.stderr)
    rows = evaluation_csv.read_csv(self.folder / "ends" / "evaluation.csv")
    steps = [row.env_step for row in rows]
    self.assertEqual([row.seed for row in rows], [3, 4])
    self.assertLess(steps[0], 400)
    self.assertEqual(steps[1], 400)
    self.assertRegex(done.stdout, rf"after {steps[0]} .* resets of seed 3:")
    self.assertRegex(done.stdout, r"all 2 checkpoints:\n.*\nbring .* 2 ")
    earlier, last = policies.at_checkpoints(policies.find(str(self.path)), 2)
    seen = np.linspace(-1, 1, 59, dtype=np.float32)
    stored = lfgp_dmc.load_policy(self.path)(seen)
    np.testing.assert_array_equal(last.make().act(seen), stored)
    self.assertGreater(np.abs(earlier.make().act(seen) - stored).max(), 0)
    for actor, named in (
      ("--run=runs/tiny", "runs/tiny"),
      ("--expert=scripted", "scripted expert"),
    ):
      done = self._call(f"evaluate.py {actor} --checkpoints=99")
      self.assertEqual(done.returncode, 1)
      self.assertRegex(done.stderr, rf"{named} has \d checkpoints")

  def test_evaluates_the_expert(self):
    done = self._call("evaluate.py --expert=scripted --tasks=reach "
                      "--episodes=2 --workers=1 --output=expert")  # fmt: skip
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertRegex(done.stdout, r"reach +100.0% +2")

  def test_adds_to_the_runs_own_rows_those_it_does_not_have(self):
    path = self.path / "evaluation.csv"
    before = evaluation_csv.read_csv(path)
    for _ in range(2):
      done = self._call("evaluate.py --run=runs/tiny --workers=1 --episodes=2")
      self.assertEqual(done.returncode, 0, done.stderr)
      rows = evaluation_csv.read_csv(path)
      self.assertEqual(rows[: len(before)], before)
      self.assertEqual([row.episode for row in rows[len(before) :]], [1])

  def test_a_policy_of_an_unknown_world_is_refused(self):
    policy = self.folder / "policy"
    policy.mkdir()
    arrays = (self.path / "policy.safetensors").read_bytes()
    (policy / "policy.safetensors").write_bytes(arrays)
    stored = json.loads((self.path / "config.json").read_text())
    for change, message in (
      ({"environment": "no.such:thing"}, "No module named 'no'"),
      ({"main_task": "juggle"}, "unknown task 'juggle'; valid tasks: stack"),
      ({"main_task": "insert"}, "main_task is 'insert'; the policy in .* has:"),
      ({"control_hz": "x"}, "control_hz is 'x'; valid: 20, 10, 5"),
      ({"policy": {}}, "policy.tasks is missing"),
    ):
      text = json.dumps({**stored, **change})
      (policy / "config.json").write_text(text)
      with self.assertRaisesRegex(command.UserError, message):
        policies.find("", str(policy))

  def test_plots(self):
    done = self._call("plot.py --runs=runs/tiny --output=figures")
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertTrue((self.folder / "figures/lfgp_bring_success.png").exists())
    done = self._call("plot.py --run=runs/tiny --output=figures --format=svg")
    self.assertEqual(done.stdout, "figures/tiny.svg\n")
    self.assertIn("<svg", (self.folder / "figures/tiny.svg").read_text())

  def test_plots_success_by_attempts_beside_its_csv(self):
    (self.folder / "few.csv").write_text(
      "method,main_task,attempts,seed,success\nbc,lift,5,0,0.5\n"
    )
    done = self._call("plot.py --attempts=few.csv --baseline=bc")
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertIn("| BC | 5 | 50 % |", done.stdout)
    self.assertEndsWith(done.stdout, "few.png\nfew_iqm.csv\n")
    self.assertTrue((self.folder / "few.png").exists())
    _, (row,) = csv_files.read(self.folder / "few_iqm.csv")
    self.assertEqual((row["main_task"], row["success"]), ("lift", "0.5"))

  def test_renders_intention_and_schedule_in_every_format(self):
    if graphics.fault():
      self.skipTest(graphics.fault())
    size = "--height=64 --width=64 --steps=10 --every=5"
    for suffix, task in zip(
      video.FORMATS, ("reach", "scheduled", "bring", "lift"), strict=True
    ):
      done = self._call(f"render_policy.py --run=runs/tiny --task={task} "
                        f"{size} --output=clip_{task}{suffix}")  # fmt: skip
      self.assertEqual(done.returncode, 0, done.stderr)
      self.assertGreater(
        (self.folder / f"clip_{task}{suffix}").stat().st_size, 100
      )
      sidecar = json.loads(
        (self.folder / f"clip_{task}{suffix}.json").read_text()
      )
      self.assertEqual((sidecar["task"], sidecar["steps"]), (task, 10))

  def test_renders_play_by_the_expert(self):
    if graphics.fault():
      self.skipTest(graphics.fault())
    done = self._call("render_policy.py --expert=scripted --collection=play "
                      "--height=64 --width=64 --every=20 "
                      "--output=play.png")  # fmt: skip
    self.assertEqual(done.returncode, 0, done.stderr)
    sidecar = json.loads((self.folder / "play.png.json").read_text())
    self.assertGreater(len(sidecar["intentions"]), 2)
    self.assertNotIn("GLFW", done.stderr)

  def test_benchmarks_print_the_agreed_lines(self):
    small = (
      "--config.agent.networks.hidden_size=16 --config.agent.batch_size=8 "
      "--config.agent.reward.batch_size=8"
    )
    lines = (
      "environment --steps=50",
      "stability --steps=50 --tasks=reach",
      f"training --steps=3 --seconds=0 {small}",
      f"learner --seconds=0 {small}",
      f"memory --steps=3 {small} --config.replay_capacity=2000",
      "acting --steps=1 --config.main_task=lift",
    )
    names = [_names(self._call(f"benchmark.py --what={x}")) for x in lines]
    self.assertEqual(
      names[0][:4],
      ["control_steps_per_s", "mj_step_per_s", "mj_step_fraction", "reset_ms"],
    )
    self.assertContainsSubset(
      ["steps", "nan", "warnings", "blocks_out", "max_block_speed"], names[1]
    )
    self.assertContainsSubset(
      [
        "learner_updates_per_s_1thread",
        "loop_fraction_2threads",
        "second_thread_gain_beside_busy",
      ],
      names[2],
    )
    self.assertContainsSubset(
      [
        "gflop_per_update",
        "updates_per_s_fp32_1thread",
        "updates_per_s_bf16_2threads",
        "matmul_gflops_fp32_1thread",
        "roofline_fraction_fp32_1thread",
      ],
      names[3],
    )
    self.assertContainsSubset(["resident_gb/0", "resident_gb"], names[4])
    self.assertContainsSubset(["evaluation_s", "collection_s"], names[5])


def _names(done: subprocess.CompletedProcess) -> list[str]:
  assert not done.returncode, done.stderr
  machine, *lines = done.stdout.splitlines()
  assert machine.startswith("machine="), machine
  for line in lines:
    float(line.partition("=")[2])
  return [line.partition("=")[0] for line in lines]
