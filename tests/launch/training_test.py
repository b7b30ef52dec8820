"""A run from its config to its files, continued, and refused."""

import dataclasses
import shutil
import signal
from unittest import mock

import numpy as np
from absl import logging
from absl.testing import parameterized

import lfgp_dmc
from lfgp_dmc import toy
from lfgp_dmc.acting import evaluation
from lfgp_dmc.agents import cloning
from lfgp_dmc.data import demonstrations, evaluation_csv
from lfgp_dmc.finite import NotFiniteError
from lfgp_dmc.launch import assemble, torch_setup
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from lfgp_dmc.runs import run, run_folder
from lfgp_dmc.runs.schedule import Progress
from tests import fixtures as shared
from tests.launch import fixtures

_WARM_START = {
  "env_steps": 60,
  "agent.pretraining.updates": 5,
  "agent.networks.actor_trunk": "own",
}


class TrainingTest(fixtures.RunTest):
  def test_leaves_rows_checkpoints_and_a_policy(self):
    run, progress = self.train(
      self.config(evaluate_first=True, evaluation_seed=5)
    )
    self.assertEqual(progress.env_step, 200)
    self.assertLen(shared.rows(run / "metrics.csv"), 10)
    rows = evaluation_csv.read_csv(run / "evaluation.csv")
    self.assertEqual({row.env_step for row in rows}, {0, 100, 200})
    self.assertEqual({row.task for row in rows}, {"right", "left"})
    self.assertEqual(
      {(row.seed, row.episode) for row in rows}, {(5, 0), (5, 1)}
    )
    self.assertTrue((run / "checkpoints" / "000000200").is_dir())
    act = lfgp_dmc.load_policy(run, "left")
    self.assertEqual(act(np.zeros(2, np.float32)).shape, (2,))
    stored = run_folder.read_config(run)
    self.assertEqual(stored["policy"]["env_step"], 200)

  def test_products_are_in_bfloat16_unless_the_cpu_would_emulate_them(self):
    numbers = {}
    for asked_for, has_products in (
      (False, False),
      (True, False),
      (True, True),
    ):
      with (
        mock.patch.object(
          torch_setup, "has_bfloat16", return_value=has_products
        ),
        self.assertLogs() as found,
      ):
        logging.info("so that there is a line")
        name = f"{asked_for}_{has_products}"
        run, _ = self.train(self.config(bfloat16=asked_for), name)
      is_told = any("config.bfloat16" in line for line in found.output)
      self.assertEqual(is_told, asked_for and not has_products)
      numbers[asked_for, has_products] = fixtures.numbers(run)
    self.assertEqual(numbers[True, False], numbers[False, False])
    self.assertNotEqual(numbers[True, True], numbers[False, False])

  def test_resumes_to_the_numbers_of_a_run_never_stopped(self):
    self.check_resume(self.config(), checkpoints=2)

  @parameterized.parameters(1, 5)  # episodes: of the first, of the last one
  def test_a_stop_in_an_evaluation_changes_no_number(self, episodes):
    config = self.config(evaluate_first=True, **_WARM_START)
    whole, _ = self.train(config, "whole")
    real, played = evaluation._Player.__call__, []

    def play_and_stop(player, job):
      played.append(job)
      if len(played) == episodes:
        signal.raise_signal(signal.SIGTERM)
      return real(player, job)

    with mock.patch.object(evaluation._Player, "__call__", play_and_stop):
      path, progress = self.train(config, "stopped")
    self.assertLen(played, episodes)
    self.assertFalse(progress.is_complete)
    newest = max((path / "checkpoints").iterdir()).name
    self.assertEqual(int(newest), progress.env_step)
    _, resumed = self.train(config, "stopped", resume=True)
    self.assertTrue(resumed.is_complete)
    self.assertEqual(fixtures.numbers(path), fixtures.numbers(whole))

  def _stop(self, *arguments):
    signal.raise_signal(signal.SIGTERM)
    self.fail("it went on")

  @parameterized.parameters("position", "reward/left")
  def test_nan_ends_the_run_and_it_goes_on_from_before(self, name):
    keeps_rewards = {
      "algorithm": "sacx",
      "demonstrations": "",
      "agent.scheduler.kind": "uniform",
    }
    config = self.config(**keeps_rewards)
    whole, _ = self.train(config, "whole")
    real, calls = toy.PointEnvironment._observe, []

    def observe(self):
      calls.append(real(self))
      if len(calls) >= 200:  # in training
        calls[-1][name] *= np.nan
      return calls[-1]

    with (
      mock.patch.object(toy.PointEnvironment, "_observe", observe),
      self.assertRaisesRegex(NotFiniteError, "in (left|position)$"),
    ):
      self.train(config, "broken")
    path, _ = self.train(config, "broken", resume=True)
    self.assertEqual(fixtures.numbers(path), fixtures.numbers(whole))

  def test_a_stop_in_the_warm_start_starts_anew(self):
    config = self.config(**_WARM_START)
    whole, _ = self.train(config, "whole")
    with mock.patch.object(cloning.IntentionCloner, "update", self._stop):
      path, progress = self.train(config, "stopped")
    self.assertEqual(progress.update, 0)
    self.assertFalse((path / "checkpoints").exists())
    self.train(config, "stopped", resume=True)
    self.assertEqual(fixtures.numbers(path), fixtures.numbers(whole))

  def test_a_policy_without_checkpoints_is_not_started_anew(self):
    path, _ = self.train(self.config())
    shutil.rmtree(path / "checkpoints")
    for steps in (200, 400):  # a run that ended; a policy folder
      kept = {file: file.read_bytes() for file in path.glob("*.*")}
      with self.assertRaisesRegex(
        UserError, "policy of step 200, but no checkpoint to go on from"
      ):
        self.train(
          self.config(env_steps=steps, checkpoint_every=150), "a", True
        )
      found = {file: file.read_bytes() for file in path.glob("*.*")}
      self.assertEqual(found, kept)
      (path / "run.lock").unlink(missing_ok=True)

  def test_another_config_is_not_resumed(self):
    self.train(self.config(env_steps=40))
    changed = {"agent.scheduler.xi": 10, "env_steps": 40, "seed": 4}
    with self.assertRaisesRegex(
      UserError, r"seed \(0, now 4\); agent.scheduler.xi \(5, now 10\)"
    ):
      self.train(self.config(**changed), resume=True)

  def test_resumes_further_with_data_that_moved(self):
    whole, _ = self.train(self.config(env_steps=200), "whole")
    run, _ = self.train(self.config(env_steps=100, replay_capacity=200))
    self.dataset.rename(self.folder / "moved")
    line = "train.py --run=runs/a --resume"
    done = fixtures.call(line, self.folder)
    self.assertRegex(done.stderr, r"\Aerror: no dataset folder .*data")
    line += " --config.env_steps=200 --config.demonstrations=moved"
    done = fixtures.call(line, self.folder)
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertEqual(fixtures.numbers(run), fixtures.numbers(whole))
    stored = run_folder.read_config(run)
    self.assertEqual((stored["env_steps"], stored["demonstrations"]),
                     (200, "moved"))  # fmt: skip
    for flag, said in (
      ("config.env_steps=100", r"Differing: env_steps \(200, now 100\)"),
      ("config.agent.scheduler.xi=9", r"Differing: .*xi \(5, now 9\)"),
      ("config.agent.scheduler.kind=uniform", r"kind \(.*, now .*uniform"),
      ("config.algorithm=bc", "Differing: algorithm"),
      ("preset=fast", r"([^;]*; ){4}and \d+ more"),
    ):
      done = fixtures.call(f"{line} --{flag}", self.folder)
      self.assertRegex(done.stderr, rf"\Aerror: runs/a was.*{said}.*\n\Z")

  def test_a_ring_that_had_no_slack_resumes_further(self):
    self.train(self.config(env_steps=40, replay_capacity=60))
    config = self.config(env_steps=120, replay_capacity=60)
    self.assertTrue(self.train(config, resume=True)[1].is_complete)

  def test_rare_checkpoints_do_not_enlarge_the_replay(self):
    path, _ = self.train(self.config(env_steps=40, checkpoint_every=10**9))
    size = (path / "replay" / "observation.npy").stat().st_size
    self.assertLess(size, 10_000)

  def test_other_demonstrations_are_not_resumed(self):
    self.train(self.config(env_steps=40))
    shutil.rmtree(self.dataset)
    fixtures.write_dataset(self.dataset, pairs=61)
    with self.assertRaisesRegex(
      UserError, "valid: the same data that the run was"
    ):
      self.train(self.config(env_steps=40), resume=True)

  def test_an_existing_folder_is_refused(self):
    run = self.folder / "runs" / "a"
    run.mkdir(parents=True)
    with self.assertRaisesRegex(UserError, "exists.*--resume"):
      self.train(self.config())
    self.assertEmpty(list(run.iterdir()))

  @parameterized.parameters(
    ({"demonstrations": ""}, "demonstrations is not set"),
    ({"demonstrations": "no/where"}, "no dataset folder no/where"),
    ({"environment": "lfgp_dmc.toy:Nothing"}, "has no attribute 'Nothing'"),
    ({"environment": "nothing.at:all"}, "No module named 'nothing'"),
    ({"device": "abacus"}, "config.device is 'abacus'"),
    (
      {"environment": "", "main_task": "lift", "episode_steps": 9},
      "config.episode_steps is 9; valid: 0",
    ),
    ({"pairs_per_task": 61}, r"fewer pairs of right \(60\), left \(60\)"),
    (
      {"attempts_per_task": 61},
      r"fewer attempts of right \(\d+\), left \(\d+\)",
    ),
    ({"main_task": "up"}, "main_task is 'up'; valid for .*: right, left$"),
    ({"main_task": "up", "algorithm": "dac"}, "up.hdf5: missing"),
    ({"agent.networks.hidden_size": 10**6}, "hidden_size is 1000000: it needs"),
    ({"agent.networks.hidden_size": 10**12}, "hidden_size is 1000000000000"),
    ({"agent.batch_size": 10**12}, "config.agent.batch_size is 1000000000000"),
    ({"agent.reward.batch_size": 10**12}, "agent.reward.batch_size is 1000000"),
    ({"replay_capacity": 10**20}, "config.replay_capacity is 1000000000000000"),
    ({"agent.scheduler.kind": "weighted_random_handcrafted"}, "handcrafted"),
    (
      {"agent.critic.masked": "0:2", "agent.networks.actor_trunk": "own"},
      "critic.masked hides all",
    ),
    (
      {"agent.reward.masked": "0:2", "agent.reward.input": "state"},
      "masked slices hide all",
    ),
  )
  def test_bad_input_leaves_no_folder(self, changes, message):
    with self.assertRaisesRegex(UserError, message):
      self.train(self.config(**changes))
    self.assertFalse((self.folder / "runs" / "a").exists())

  @parameterized.parameters(
    ("assemble.make_parts", MemoryError("9 GB")),
    ("assemble.make_agent", MemoryError()),
    ("assemble.Run.train", RuntimeError("can't allocate memory\nmore")),
  )
  def test_too_little_memory_is_told_and_leaves_no_folder(self, place, fault):
    with (
      mock.patch(f"lfgp_dmc.launch.{place}", side_effect=fault),
      self.assertRaisesRegex(
        UserError,
        r"^out of memory: .* config.agent.networks.hidden_size \(16\)",
      ),
    ):
      self.train(self.config())
    self.assertFalse((self.folder / "runs" / "a").exists())

  def test_other_faults_are_not_taken_for_want_of_memory(self):
    fault = OSError(28, "No space left on device", "runs/allocated/a")
    with (
      mock.patch.object(run.Run, "_checkpoint", side_effect=fault),
      self.assertRaisesRegex(OSError, "No space left"),
    ):
      self.train(self.config())
    self.assertTrue((self.folder / "runs" / "a").exists())

  def test_each_continuation_has_starts_of_its_own(self):
    seeds = []
    with mock.patch.object(EnvironmentSpec, "build", autospec=True) as build:
      build.side_effect = lambda spec, _, seed: (
        seeds.append(seed) or toy.PointEnvironment()
      )
      for kept in ("", "20 40 60", "40 60 80"):  # of older ones, few stay
        for step in kept.split():
          path = self.folder / kept / "checkpoints" / f"{step:0>9}"
          path.mkdir(parents=True)
        assemble.make_parts(self.config(), self.folder / kept)
    self.assertLen(set(seeds), 3)

  def test_little_memory_later_loses_nothing(self):
    config = self.config(env_steps=120, checkpoint_every=60)
    fault = RuntimeError("can't allocate memory")
    with (
      mock.patch.object(run.Run, "_evaluate", side_effect=fault),
      self.assertRaisesRegex(UserError, "out of memory"),
    ):
      self.train(config)
    self.assertTrue((self.folder / "runs" / "a").exists())

  @parameterized.parameters(
    (
      "lfgp_dmc.launch.assemble.make_agent",
      KeyboardInterrupt(),
      KeyboardInterrupt,
    ),
    ("lfgp_dmc.launch.assemble.make_agent", KeyError("ours"), KeyError),
    ("fcntl.flock", OSError(37, "No locks"), OSError),
    ("lfgp_dmc.runs.run_folder.files.write_json", OSError(28, "full"), OSError),
  )
  def test_whatever_happens_before_the_start_no_folder_is_left(
    self, place, fault, raised
  ):
    with (
      mock.patch(place, side_effect=fault),
      self.assertRaises(raised),
    ):
      self.train(self.config())
    self.assertFalse((self.folder / "runs" / "a").exists())

  def test_every_fault_of_a_dataset_is_told(self):
    (self.dataset / "right.hdf5").write_bytes(b"not HDF5")
    (self.dataset / "left.hdf5").unlink()
    with self.assertRaisesRegex(
      UserError, r"(?s)right.hdf5: not a readable.*left.hdf5: missing"
    ):
      self.train(self.config())

  def test_demonstrations_of_another_rate_are_refused(self):
    folder = self.folder / "lift"
    fixtures.write_dataset(folder, ("lift",), 59, 4)
    config = self.config(
      demonstrations=str(folder), environment="", main_task="lift", control_hz=5
    )
    with self.assertRaisesRegex(
      UserError, r"config.control_hz is 5; .* another rate: lift \(20\)"
    ):
      self.train(config)

  def _made(self, name="a", **changes):
    """The run's folder, and what its training loop was made of."""
    with mock.patch.object(run, "EpisodeRounds") as rounds:
      rounds.return_value.run.return_value = Progress()
      path, _ = self.train(self.config(**changes), name)
    return path, rounds.call_args.args

  def test_the_schedule_is_that_of_the_config(self):
    given = {
      "env_steps": 61, "log_every": 3, "evaluate_every": 5, "random_steps": 7,
      "checkpoint_every": 11, "updates_per_step": 0.5, "evaluate_first": True,
    }  # fmt: skip
    _, (_, _, _, schedule, *_) = self._made(warm_up=13, **given)
    expected = {**given, "warmup_steps": 13, "progress_bar": False}
    self.assertEqual(dataclasses.asdict(schedule), expected)

  def test_the_seed_decides_starts_and_networks(self):
    seeds, policies = [], []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
      path, arguments = self._made(name, seed=seed)
      seeds.append(arguments[-1])
      policies.append((path / "policy.safetensors").read_bytes())
    for first, same, other in (seeds, policies):
      self.assertEqual(first, same)
      self.assertNotEqual(first, other)

  def test_uses_the_first_pairs_alone(self):
    _, arguments = self._made(pairs_per_task=20)
    found = arguments[1]._experts._observation
    shown = [
      demonstrations.read(self.dataset / f"{task}.hdf5").observation[:20]
      for task in ("right", "left")
    ]
    np.testing.assert_array_equal(found, np.concatenate(shown))

  def test_a_smaller_replay_resumes_too(self):
    self.check_resume(self.config(replay_capacity=60, env_steps=120))
