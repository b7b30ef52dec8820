"""Configs: defaults, presets, flagfiles, and what is refused."""

import dataclasses
import pathlib

from absl import flags
from absl.testing import absltest, parameterized

from agents.lfgp import LfgpConfig
from launch import config_flags, configs
from lfgp_dmc import task_names

_FLAGS = pathlib.Path(config_flags.__file__).parent / "flags"
# Of runs: not the sweep, whose flags are launch/sweep.py's.
_FLAGFILES = sorted(
  path.name
  for path in _FLAGS.glob("*.flags")
  if path.name != "paper_sweep.flags"
)


def resolve(*arguments: str) -> configs.RunConfig:
  """What a command with these arguments gets."""
  values = flags.FlagValues()
  expanded = flags.FLAGS.read_flags_from_files(list(arguments))
  config_flags.define(expanded, values)
  values(["command", *expanded])
  return config_flags.resolved(values)


class ConfigTest(parameterized.TestCase):
  def test_defaults_are_the_dataclasses_own(self):
    config = resolve()
    self.assertEqual(config, configs.RunConfig(agent=LfgpConfig()))
    self.assertEqual(config.env_steps, 4_000_000)
    self.assertEqual(config.evaluate_every, 100_000)
    self.assertEqual(config.log_every, 500)
    self.assertEqual(config.evaluation_episodes, 50)

  def test_flags_override_the_preset_wherever_they_stand(self):
    config = resolve(
      "--config.agent.polyak=0.5", "--preset=ral", "--config.seed=3"
    )
    self.assertEqual(config.agent.polyak, 0.5)
    self.assertEqual(config.agent.weight_decay, 0.01)
    self.assertEqual(config.seed, 3)

  @parameterized.product(
    preset=list(configs.PRESETS), algorithm=list(configs.ALGORITHMS)
  )
  def test_every_preset_fits_every_algorithm(self, preset, algorithm):
    config = resolve(f"--config.algorithm={algorithm}", f"--preset={preset}")
    self.assertEqual(config.algorithm, algorithm)
    for name, value in configs.ALGORITHMS[algorithm].defaults.items():
      self.assertEqual(getattr(config.agent, name), value)

  def test_presets_name_fields_that_exist(self):
    fields = {field.name for field in dataclasses.fields(LfgpConfig)}
    run_fields = {f.name for f in dataclasses.fields(configs.RunConfig)}
    for changes in configs.PRESETS.values():
      for name in changes:
        known = fields if name.startswith("agent.") else run_fields
        self.assertIn(name.removeprefix("agent."), known)

  def test_comes_back_from_its_json_form(self):
    config = resolve("--preset=fast", "--config.main_task=bring")
    self.assertEqual(configs.from_dict(config.to_dict()), config)

  @parameterized.parameters(
    ("--config.agent.sheduler=uniform", "did you mean --config.agent.sched"),
    ("--config.nothing_like_it=1", "unknown --config.nothing_like_it"),
    ("--preset=quick", "unknown preset 'quick'; valid: paper, ral, fast"),
    ("--config.algorithm=dqn", "unknown algorithm 'dqn'; valid: lfgp"),
    ("--config.main_task=juggle", "config.main_task is 'juggle'; valid: stack"),
    ("--config.env_steps=0", "config.env_steps is 0; valid: 1 or more"),
    ("--config.agent.xi=0", "xi is 0; valid: an integer above 0"),
    ("--config.environment=toy", "config.environment is 'toy'; valid"),
    ("--config.control_hz=7", "config.control_hz is 7; valid: 20, 10, 5"),
    ("--config.control_hz=5", "episode_steps is 360; valid: at most 90, 18 s"),
  )
  def test_bad_values_are_refused(self, argument, message):
    with self.assertRaisesWithLiteralMatch(ValueError, ""):
      try:
        resolve(argument)
      except ValueError as error:
        self.assertIn(message, str(error))
        raise ValueError("") from None

  def test_pairs_and_attempts_are_not_both_counted(self):
    with self.assertRaisesRegex(ValueError, "attempts_per_task is 5; valid: 0"):
      resolve("--config.attempts_per_task=5", "--config.pairs_per_task=9")

  def test_only_the_block_tasks_have_mirror_images(self):
    images = "--config.mirror_demonstrations"
    self.assertTrue(resolve(images).mirror_demonstrations)
    with self.assertRaisesRegex(ValueError, "mirror_demonstrations is True"):
      resolve(images, "--config.environment=package.module:factory")

  def test_a_value_of_another_type_is_a_flag_error(self):
    with self.assertRaises(flags.IllegalFlagValueError):
      resolve("--config.seed=many")

  def test_unknown_stored_fields_are_named(self):
    values = configs.RunConfig(agent=LfgpConfig()).to_dict()
    values["sed"] = 3
    with self.assertRaisesRegex(ValueError, "unknown config.sed; .*seed"):
      configs.from_dict(values)

  def test_a_run_older_than_a_field_has_its_default(self):
    config = resolve("--config.algorithm=dac", "--config.seed=3")
    values = config.to_dict()
    del values["control_hz"], values["agent"]["layout"]
    self.assertEqual(configs.from_dict(values), config)


class FlagfilesTest(parameterized.TestCase):
  @parameterized.parameters(*_FLAGFILES)
  def test_parses_to_a_valid_config(self, name):
    config = resolve(f"--flagfile={_FLAGS / name}")
    text = (_FLAGS / name).read_text(encoding="utf-8")
    if config.transfer_from:
      self.assertIn(f"--run={config.transfer_from}", text)
    if not config.uses_demonstrations:
      self.assertEmpty(config.demonstrations)
      return
    self.assertNotEmpty(config.demonstrations)
    self.assertIn("collect_demonstrations.py", text)
    self.assertIn(f"--output={config.demonstrations}", text)

  @parameterized.product(
    algorithm=list(configs.ALGORITHMS), main_task=task_names.MAIN_TASKS
  )
  def test_is_named_after_algorithm_and_main_task(self, algorithm, main_task):
    path = _FLAGS / f"{algorithm}_{main_task}.flags"
    config = resolve(f"--flagfile={path}")
    self.assertEqual((config.algorithm, config.main_task),
                     (algorithm, main_task))  # fmt: skip

  @parameterized.parameters(
    ("stack", "move_object"),
    ("bring", "move_object"),
    ("unstack_stack", "stack"),
    ("insert", "bring"),
  )
  def test_transfers_come_from_where_the_papers_do(self, main_task, source):
    path = _FLAGS / f"lfgp_transfer_{main_task}.flags"
    config = resolve(f"--flagfile={path}")
    self.assertEqual((config.main_task, config.transfer_from),
                     (main_task, f"runs/lfgp_{source}"))  # fmt: skip
    path = _FLAGS / f"sacx_{main_task}.flags"
    config = resolve(f"--flagfile={path}", "--config.transfer_from=")
    self.assertEqual(config.agent.scheduler, "conditional_weighted")
    self.assertEqual(config.transfer_from, "")

  @parameterized.parameters(*configs.PRESETS)
  def test_no_preset_makes_sacx_need_demonstrations(self, preset):
    config = resolve("--config.algorithm=sacx", f"--preset={preset}")
    self.assertFalse(config.uses_demonstrations)
    self.assertTrue(config.keeps_rewards)
    self.assertEqual((config.agent.warm_up, config.agent.random_steps),
                     (10_000, 0))  # fmt: skip


if __name__ == "__main__":
  absltest.main()
