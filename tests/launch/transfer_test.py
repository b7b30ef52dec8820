"""Runs that go on from other runs: SAC-X, transfers, stored policies."""

from unittest import mock

import numpy as np

from lfgp_dmc import task_names, toy
from lfgp_dmc.acting import environments
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data import files
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import assemble, configs
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run import Run
from tests import fixtures as shared
from tests.launch import fixtures


class TwoWorlds(toy.PointEnvironment):
  """The toy world, told as one whose tasks are "right" and "up"."""

  def observation_spec(self):
    return _renamed(super().observation_spec())

  def _observe(self):
    return _renamed(super()._observe())


def _renamed(named):
  return {name.replace("/left", "/up"): part for name, part in named.items()}


OTHER = "tests.launch.transfer_test:TwoWorlds"


class _RunTest(fixtures.RunTest):
  def setUp(self):
    super().setUp()
    fixtures.write_dataset(self.folder / "other", ("right", "up"))

  def config(self, algorithm="lfgp", **changes):
    if algorithm == "sacx":
      own = {"algorithm": "sacx", "demonstrations": "", "random_steps": 0}
      changes = {**own, "agent.scheduler.kind": "uniform", **changes}
    options = {"evaluate_every": 1000, "env_steps": 100, **changes}
    return super().config(**options)


class SacxTest(_RunTest):
  def test_needs_no_demonstrations_and_keeps_all_rewards(self):
    path, _ = self.train(self.config("sacx"), "a")
    stored = Replay.stored(path / "replay")
    self.assertEqual(stored.reward_tasks, ("right", "left"))
    rows = np.arange(len(stored))
    position = stored.gather(rows).next_observation[:, 0]
    expected = [1 - np.abs(position - 0.8), 1 - np.abs(position + 0.8)]
    np.testing.assert_allclose(
      stored.gather_rewards(rows), np.stack(expected, axis=1), atol=1e-5
    )
    (*_, last) = shared.rows(path / "metrics.csv")
    self.assertEqual(last["loss/discriminator"], "nan")
    self.assertNotEqual(last["reward/left"], "nan")

  def test_killed_and_resumed_it_keeps_the_rewards_and_the_numbers(self):
    config = self.config("sacx", replay_capacity=60)
    whole, _ = self.train(config, "whole")
    with fixtures.stopped_after(1):
      path, progress = self.train(config, "killed")
    self.assertLess(progress.env_step, 100)
    # As if killed later: rows beyond the checkpoint, which are to be forgotten.
    replay = Replay(
      60, 2, 2, path / "replay", slack=80, reward_tasks=("right", "left")
    )
    rows = np.arange(len(replay))[-5:]
    replay.add_batch(replay.gather(rows), 100 + replay.gather_rewards(rows))
    replay.flush()
    del replay
    self.train(config, "killed", resume=True)
    self.assertEqual(fixtures.numbers(path), fixtures.numbers(whole))
    rewards = [
      stored.gather_rewards(np.arange(len(stored)))
      for stored in (Replay.stored(run / "replay") for run in (path, whole))
    ]
    np.testing.assert_array_equal(*rewards)

  def test_a_task_without_a_conditional_table_is_told(self):
    with self.assertRaisesRegex(UserError, "no conditional table for.*'right'"):
      config = {"agent.scheduler.kind": "conditional_weighted"}
      self.train(self.config("sacx", **config), "a")

  def test_the_block_world_shows_the_rewards_of_all_nine_tasks(self):
    config = configs.from_dict(configs.make_config("sacx").to_dict())
    environment = config.environment_spec.build(config.agent.keeps_rewards)
    shown = environments.with_observed_tasks(
      environment, ("stack", "reach"), "reward/"
    )
    self.assertEqual(shown[:2], ("stack", "reach"))
    self.assertCountEqual(shown, task_names.ALL_TASKS)


class TransferTest(_RunTest):
  def _to(self, source, algorithm="lfgp", **changes):
    return self.config(
      algorithm,
      **{
        "environment": OTHER,
        "main_task": "up",
        "demonstrations": ""
        if algorithm == "sacx"
        else str(self.folder / "other"),
        "transfer_from": str(source),
        "transfer_updates": 7,
        "warm_up": 150,
        **changes,
      },
    )

  def test_starts_with_the_other_runs_networks_and_replay(self):
    source, _ = self.train(self.config(), "source")
    policy = Policy.load(source)
    started = {}
    real = Run.train

    def look(run):
      started["policy"] = run.agent.policy.arrays()
      started["rows"] = len(run.replay)
      return real(run)

    with mock.patch.object(Run, "train", look):
      path, _ = self.train(self._to(source), "new")
    self.assertEqual(started["rows"], 100)
    for name, array in started["policy"].items():
      old = policy.arrays()[name]
      if name.startswith("heads."):  # "right" moved from place 0 to 1
        array, old = array[1], old[0]
      np.testing.assert_array_equal(array, old)
    state = checkpoints.load(checkpoints.latest(path / "checkpoints"))
    # 7 before the first step, and one a step: there is no warm-up.
    self.assertEqual(state["agent"]["learner"]["updates"], 107)
    self.assertEqual(state["replay_total"], 200)

  def test_learns_with_a_replay_that_holds_less_than_a_batch(self):
    source, _ = self.train(self.config(), "source")
    _, progress = self.train(self._to(source, replay_capacity=5), "new")
    self.assertEqual(progress.update, 100)

  def test_rewards_of_a_new_task_come_from_the_old_replay(self):
    """SAC-X stored the reward of "left", which becomes a task only later."""
    config = self.config("sacx", **{"env_steps": 60})
    with mock.patch.object(assemble, "tasks_of", lambda *_: ("right",)):
      source, _ = self.train(config, "source")
    self.assertEqual(run_folder.read_config(source)["policy"]["tasks"],
                     ["right"])  # fmt: skip
    target = self._to(
      source, "sacx", environment=fixtures.POINT, main_task="left"
    )
    path, _ = self.train(target, "new")
    stored = Replay.stored(path / "replay")
    self.assertEqual(stored.reward_tasks, ("left", "right"))
    rows = np.arange(len(stored))
    rewards = stored.gather_rewards(rows)
    self.assertLen(rewards, 160)
    position = stored.gather(rows).next_observation[:, 0]
    np.testing.assert_allclose(rewards[:, 0], 1 - abs(position + 0.8),
                               atol=1e-5)  # fmt: skip

  def test_resumes_to_the_numbers_of_a_run_never_stopped(self):
    source, _ = self.train(self.config(), "source")
    config = self._to(source)
    whole, _ = self.train(config, "whole")
    with fixtures.stopped_after(1):
      path, _ = self.train(config, "killed")
    source.rename(self.folder / "moved")  # it is not needed any more
    self.train(config, "killed", resume=True)
    self.assertEqual(fixtures.numbers(path), fixtures.numbers(whole))

  def test_killed_before_its_first_checkpoint_it_transfers_again(self):
    source, _ = self.train(self.config(), "source")
    config = self._to(source)
    whole, _ = self.train(config, "whole")
    with (
      mock.patch.object(Run, "_checkpoint", side_effect=KeyboardInterrupt),
      self.assertRaises(KeyboardInterrupt),
    ):
      self.train(config, "killed")
    path, _ = self.train(config, "killed", resume=True)
    self.assertEqual(fixtures.numbers(path), fixtures.numbers(whole))

  def test_what_cannot_be_transferred_from_leaves_no_folder(self):
    lfgp, _ = self.train(self.config(), "lfgp")
    small, _ = self.train(
      self.config(**{"agent.networks.hidden_size": 8}), "small"
    )
    bare = self.folder / "bare"
    Policy.load(lfgp).save(bare)
    for config, message in (
      (self._to("no/where"), "transfer_from: no run folder no/where"),
      (self._to(bare), "bare has no good checkpoint"),
      (self._to(small), "intentions: .*has shape"),
      (self._to(lfgp, "sacx"), "keeps no rewards of up, right"),
    ):
      with self.assertRaisesRegex(UserError, message):
        self.train(config, "new")
      self.assertFalse((self.folder / "runs" / "new").exists())


class InitFromTest(_RunTest):
  def test_starts_from_a_policy_folder(self):
    source, _ = self.train(self.config(), "source")
    bare = self.folder / "bare"
    Policy.load(source).save(bare)
    config = self.config(
      init_from=str(bare), **{"agent.networks.actor_trunk": "own"}
    )
    rows, acts = np.eye(2, dtype=np.float32), []

    def look(run):
      acts.append(run.agent.policy.act(rows, "left"))

    with mock.patch.object(Run, "train", look):
      self.train(config, "a")
    expected = Policy.load(source).act(rows, "left")
    np.testing.assert_array_equal(acts, [expected])
    self.train(config, "a", resume=True)  # was killed at once: starts again
    fixtures.write_dataset(self.folder / "lift", ("lift",), 59, 4)
    block = self.config(
      init_from=str(bare), demonstrations=str(self.folder / "lift"),
      environment="", main_task="lift", control_hz=20,
      **{"agent.networks.actor_trunk": "own"},
    )  # fmt: skip
    options = files.read_json(bare / "config.json")
    files.write_json(bare / "config.json", options | {"control_hz": 5})
    with self.assertRaisesRegex(UserError, "control_hz is 20; init_from .* 5"):
      self.train(block, "b")
    wrong = self.config(
      init_from=str(self.folder / "data"),
      **{"agent.networks.actor_trunk": "own"},
    )
    with self.assertRaisesRegex(UserError, "no policy in .*data"):
      self.train(wrong, "b")

  def test_inputs_that_mean_something_else_are_refused(self):
    scale = "agent.inputs.tanh_feature_scale"
    source, _ = self.train(self.config(env_steps=20, **{scale: 0.1}), "source")
    standardise = "agent.inputs.standardise"
    for changes, message in (
      ({scale: 0.2}, f"{scale} is 0.2; init_from .* 0.1"),
      ({scale: 0.1, standardise: True}, f"{standardise} is True; .* False"),
    ):
      config = self.config(
        init_from=str(source),
        **{"agent.networks.actor_trunk": "own", **changes},
      )
      with self.assertRaisesRegex(UserError, message):
        self.train(config)

  def test_standardisation_comes_along(self):
    own = {"agent.networks.actor_trunk": "own"}
    whole = {**own, "agent.inputs.standardise": True}
    source, _ = self.train(self.config(env_steps=20, **whole), "source")
    config = self.config(init_from=str(source), env_steps=20, **own)
    run, _ = self.train(config, "a")
    before, after = (
      Policy.load(folder).arrays()["standardiser.deviation"]
      for folder in (source, run)
    )
    self.assertFalse((before == 1).all())
    np.testing.assert_array_equal(before, after)


class ExamplesTest(_RunTest):
  def test_resumes_to_the_numbers_of_a_run_never_stopped(self):
    config = self.config(
      **{
        "agent.reward.kind": "examples",
        "agent.scheduler.kind": "weighted_random",
        "agent.critic.value_penalty": 10.0,
        "agent.reward.scale": 0.1,
      }
    )
    self.check_resume(config)
    (*_, last) = shared.rows(self.folder / "runs/whole/metrics.csv")
    self.assertAlmostEqual(float(last["value_low/left"]), -10.0, places=4)
