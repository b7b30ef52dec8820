"""Configs: defaults, presets, flagfiles, and what is refused."""

import itertools
import json
import pathlib

from absl import flags
from absl.testing import parameterized

from lfgp_dmc import task_names
from lfgp_dmc.launch import config_flags, configs
from lfgp_dmc.launch.config_flags import config_of

_FLAGS = pathlib.Path(config_flags.__file__).parent / "flags"
# Of runs: not the sweep, whose flags are launch/sweep.py's.
_FLAGFILES = sorted(
  path.name
  for path in _FLAGS.glob("*.flags")
  if path.name != "paper_sweep.flags"
)


class ConfigTest(parameterized.TestCase):
  def test_defaults_are_the_dataclasses_own(self):
    config = config_of()
    self.assertEqual(config, configs.RunConfig())
    self.assertEqual(config.env_steps, 4_000_000)
    self.assertEqual(config.evaluate_every, 100_000)
    self.assertEqual(config.log_every, 500)
    self.assertEqual(config.evaluation_episodes, 50)
    self.assertEqual((config.warm_up, config.random_steps), (1000, 1000))
    self.assertEqual(config.most_episode_steps, 360)
    self.assertEqual(config_of("--preset=fast").most_episode_steps, 90)

  def test_flags_override_the_preset_wherever_they_stand(self):
    config = config_of(
      "--config.agent.critic.polyak=0.5", "--preset=ral", "--config.seed=3"
    )
    self.assertEqual(config.agent.critic.polyak, 0.5)
    self.assertEqual(config.agent.optimiser.weight_decay, 0.01)
    self.assertEqual(config.seed, 3)

  @parameterized.product(
    preset=list(configs.PRESETS), algorithm=list(configs.ALGORITHMS)
  )
  def test_every_preset_fits_every_algorithm(self, preset, algorithm):
    config = config_of(f"--config.algorithm={algorithm}", f"--preset={preset}")
    self.assertEqual(config.algorithm, algorithm)
    values = dict(configs.flattened(config.to_dict()))
    chosen, of_preset = configs.ALGORITHMS[algorithm], configs.PRESETS[preset]
    self.assertEqual({k: values[k] for k in chosen.defaults}, chosen.defaults)
    for name, value in of_preset.items():
      group = ".".join(name.split(".")[:2])
      kind = group + configs.KIND
      is_left_out = (
        name in chosen.defaults
        or name not in values
        or group.removeprefix("agent.") in chosen.without
        or values.get(kind) != of_preset.get(kind)
      )
      self.assertTrue(is_left_out or values[name] == value, name)

  def test_presets_name_fields_that_exist_and_their_kinds(self):
    for preset, changes in configs.PRESETS.items():
      kinds = {k: v for k, v in changes.items() if k.endswith(configs.KIND)}
      names: set[str] = set()
      for algorithm, of_kind in (("lfgp", kinds), ("bc", {})):
        values = configs.make_config(algorithm, kinds=of_kind).to_dict()
        names |= set(dict(configs.flattened(values)))
      self.assertLessEqual(set(changes), names)
      groups = {name.split(".")[1] for name in changes if "." in name}
      for group in groups & {"reward", "scheduler"}:
        self.assertIn(f"agent.{group}.kind", changes, preset)

  def test_the_flagfile_for_20_hz_means_the_seconds_of_that_for_5(self):
    slow = config_of("--flagfile=launch/flags/lfgp_few.flags")
    fast = config_of("--flagfile=launch/flags/lfgp_few_20hz.flags")
    self.assertEqual((slow.control_hz, fast.control_hz), (5, 20))
    of_agents = slow.agent, fast.agent
    xi, more_xi = (agent.scheduler.xi for agent in of_agents)
    rows, more_rows = (agent.final_rows for agent in of_agents)
    discount, closer_to_1 = (agent.critic.discount for agent in of_agents)
    self.assertEqual((more_xi, more_rows), (4 * xi, 4 * rows))
    self.assertAlmostEqual(closer_to_1**4, discount, places=3)
    for name in ("warm_up", "random_steps", "checkpoint_every", "log_every"):
      self.assertEqual(getattr(fast, name), 4 * getattr(slow, name), name)

  @parameterized.parameters(*configs.ALGORITHMS)
  def test_comes_back_from_its_json_form(self, algorithm):
    config = config_of(
      "--preset=fast", "--config.main_task=bring",
      f"--config.algorithm={algorithm}",
    )  # fmt: skip
    values = json.loads(json.dumps(config.to_dict()))
    self.assertEqual(configs.from_dict(values), config)

  def test_a_kind_chooses_the_fields_of_its_group(self):
    config = config_of(
      "--preset=fast_precise",
      "--config.agent.scheduler.kind=q_table",
      "--config.agent.scheduler.phi=0.5",
    )
    # The preset's own fields are of another kind.
    self.assertEqual((config.agent.scheduler.phi, config.agent.scheduler.xi),
                     (0.5, 45))  # fmt: skip
    with self.assertRaisesRegex(ValueError, "unknown --config.agent.sched"):
      config_of("--config.agent.scheduler.main_weight=0.5")

  @parameterized.parameters(
    itertools.product(("ral", "vpace", "fast", "fast_precise", "few"),
                      ("stack", "insert"))
  )  # fmt: skip
  def test_another_environment_has_nothing_of_our_blocks(self, preset, task):
    config = config_of(f"--preset={preset}", f"--config.main_task={task}",
                       "--config.environment=a:b")  # fmt: skip
    critic, reward = config.agent.critic, config.agent.reward
    slices = critic.masked, critic.revealed, getattr(reward, "masked", "")
    self.assertEqual((*slices, getattr(reward, "main_masked", "")), ("",) * 4)
    self.assertEqual(config.agent.scheduler.kind, "weighted_random")
    symmetries = config.mirror_demonstrations, config.shifted_copies
    self.assertEqual(symmetries, (False, 0))
    ours = config_of(f"--preset={preset}", f"--config.main_task={task}")
    self.assertEqual(config.agent.batch_size, ours.agent.batch_size)

  def test_insert_is_more_precise(self):
    bring, insert = (
      config_of("--preset=fast_precise", f"--config.main_task={task}")
      for task in ("bring", "insert")
    )
    self.assertEqual((bring.bfloat16, insert.bfloat16), (True, False))
    self.assertEqual(insert.agent.inputs.tanh_feature_scale, 0.01)
    self.assertEqual(bring.agent.prior, insert.agent.prior)

  def test_critics_of_few_see_the_tilt_of_insert_after_a_third_of_a_run(self):
    config = config_of("--preset=few", "--config.main_task=insert")
    updates = config.env_steps * config.updates_per_step
    self.assertEqual(config.agent.critic.revealed_after, updates / 3)

  @parameterized.parameters(
    (
      "--config.agent.sheduler.xi=5",
      "unknown --config.agent.sheduler.xi; did you mean "
      "--config.agent.scheduler.xi",
    ),
    ("--config.nothing_like_it=1", "unknown --config.nothing_like_it"),
    ("--preset=quick", "unknown preset 'quick'; valid: paper, ral, vpace"),
    ("--config.algorithm=dqn", "unknown algorithm 'dqn'; valid: lfgp"),
    ("--config.main_task=juggle", "config.main_task is 'juggle'; valid: stack"),
    (
      "--config.env_steps=0",
      "config.env_steps is 0; valid: greater than or equal to 1",
    ),
    (
      "--config.agent.scheduler.xi=0",
      "config.agent.scheduler.xi is 0; valid: greater than or equal to 1",
    ),
    (
      "--config.agent.scheduler.kind=greedy",
      "config.agent.scheduler.kind is 'greedy'; valid: 'q_table', 'weighted",
    ),
    (
      "--config.agent.pretraining.updates=1",
      "config.agent.networks.actor_trunk is 'shared'; valid: own",
    ),
    ("--config.environment=toy", "config.environment is 'toy'; valid"),
    (
      "--config.init_from=a --config.transfer_from=b",
      "config.init_from is 'a'; valid: nothing with transfer_from",
    ),
    ("--config.control_hz=7", "config.control_hz is 7; valid: 20, 10, 5"),
    ("--config.init_from=a", "config.init_from is 'a'; valid: nothing, unl"),
    (
      "--config.replay_capacity=999",
      "config.warm_up is 1000; valid: at most replay_capacity, 999",
    ),
    (
      "--preset=fast --config.agent.pretraining.updates=0",
      "config.agent.prior.weight is 5.0; valid: 0 without",
    ),
    (
      "--config.agent.reward.expert_share=0.001",
      "config.agent.reward.expert_share is 0.001; valid: 0, or what makes",
    ),
    (
      "--config.agent.reward.main_expert_share=0.5",
      "config.agent.reward.main_expert_share is 0.5; valid: 0 without",
    ),
    (
      "--config.algorithm=bc --config.transfer_from=runs/x",
      "config.transfer_from is 'runs/x'; valid: nothing with bc, which keeps",
    ),
    (
      "--config.transfer_from={source_task} --config.main_task=lift",
      "config.main_task is 'lift'; valid, with {source_task}: stack",
    ),
    (
      "--config.seed=-1 --config.agent.critic.polyak=2.0",
      "config.seed is -1; valid: greater than or equal to 0\n"
      "config.agent.critic.polyak is 2.0; valid: less than or equal to 1",
    ),
  )
  def test_bad_values_are_refused(self, arguments, message):
    with self.assertRaises(ValueError) as caught:
      config_of(*arguments.split())
    self.assertIn(message, str(caught.exception))

  def test_frames_of_another_environment_are_its_own(self):
    config = config_of("--preset=pixels", "--config.environment=a:b",
                       "--config.agent.prior.weight=0",
                       "--config.transfer_from=a")  # fmt: skip
    self.assertEqual(config.environment_spec.camera_size, 0)

  def test_only_the_block_tasks_have_symmetries(self):
    images = "--config.mirror_demonstrations"
    self.assertTrue(config_of(images).mirror_demonstrations)
    for symmetry in (images, "--config.shifted_copies=1"):
      with self.assertRaisesRegex(
        ValueError, "is (True; valid: False|1; valid: 0) with environment"
      ):
        config_of(symmetry, "--config.environment=package.module:factory")

  def test_pairs_and_attempts_are_not_both_counted(self):
    with self.assertRaisesRegex(ValueError, "collect_missing is True"):
      config_of("--config.collect_missing")
    with self.assertRaisesRegex(ValueError, "attempts_per_task is 5; valid: 0"):
      config_of("--config.attempts_per_task=5", "--config.pairs_per_task=9")

  def test_a_value_of_another_type_is_a_flag_error(self):
    with self.assertRaises(flags.IllegalFlagValueError):
      config_of("--config.seed=many")

  def test_unknown_stored_fields_are_named(self):
    values = configs.RunConfig().to_dict()
    values["sed"] = values["agent"]["xi"] = 3
    with self.assertRaisesRegex(
      ValueError, "unknown config.agent.xi; .*\nunknown config.sed; .*seed"
    ):
      configs.from_dict(values)

  def test_a_run_older_than_a_field_has_its_default(self):
    config = config_of("--config.algorithm=dac", "--config.seed=3")
    values = config.to_dict()
    del values["control_hz"], values["agent"]["networks"]["layout"]
    del values["agent"]["critic"]
    self.assertEqual(configs.from_dict(values), config)

  @parameterized.parameters(*configs.PRESETS)
  def test_no_preset_makes_sacx_need_demonstrations(self, preset):
    config = config_of("--config.algorithm=sacx", f"--preset={preset}")
    self.assertFalse(config.agent.uses_demonstrations)
    self.assertTrue(config.agent.keeps_rewards)

  @parameterized.parameters(*task_names.MAIN_TASKS)
  def test_sacx_sees_the_velocities_that_its_rewards_hang_on(self, task):
    flags = ("--preset=few", f"--config.main_task={task}")
    critic = config_of("--config.algorithm=sacx", *flags).agent.critic
    self.assertEqual((critic.masked, critic.revealed), ("", ""))
    self.assertNotEqual(config_of(*flags).agent.critic.masked, "")


class FlagfilesTest(parameterized.TestCase):
  @parameterized.parameters(*_FLAGFILES)
  def test_resolves_for_every_main_task(self, name):
    for task in task_names.MAIN_TASKS:
      config = config_of(
        f"--flagfile={_FLAGS / name}", f"--config.main_task={task}"
      )
      self.assertEqual(
        config.agent.uses_demonstrations, bool(config.demonstrations)
      )
      if config.demonstrations:
        self.assertStartsWith(config.demonstrations, f"data/{task}_")

  def test_there_is_one_for_each_algorithm_and_few_others(self):
    for algorithm in configs.ALGORITHMS:
      config = config_of(f"--flagfile={_FLAGS / algorithm}.flags")
      self.assertEqual(config.algorithm, algorithm)
    self.assertLessEqual(len(list(_FLAGS.iterdir())), 17)

  @parameterized.parameters(
    ("stack", "move_object"),
    ("bring", "move_object"),
    ("unstack_stack", "stack"),
    ("insert", "bring"),
  )
  def test_transfers_come_from_where_the_papers_do(self, main_task, source):
    path = _FLAGS / "lfgp_transfer.flags"
    task = f"--config.main_task={main_task}"
    config = config_of(f"--flagfile={path}", task)
    self.assertEqual(config.transfer_from, f"runs/lfgp_{source}")
    path = _FLAGS / "sacx.flags"
    config = config_of(f"--flagfile={path}", task, "--config.transfer_from=")
    self.assertEqual(config.agent.scheduler.kind, "conditional_weighted")
    self.assertEqual(config.transfer_from, "")
