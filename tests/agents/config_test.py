"""LfgpConfig: the paper's table by default, errors that help."""

import dataclasses

from absl.testing import absltest, parameterized

from lfgp_dmc.agents.lfgp.config import LfgpConfig


class LfgpConfigTest(parameterized.TestCase):
  def test_defaults_are_the_papers_table(self):
    table = {
      "batch_size": 256,
      "discount": 0.99,
      "polyak": 0.005,
      "critic_learning_rate": 3e-4,
      "intention_learning_rate": 1e-5,
      "temperature_learning_rate": 3e-4,
      "initial_temperature": 1.0,
      "target_entropy": -4.0,
      "max_gradient_norm": 10.0,
      "discriminator_learning_rate": 3e-4,
      "discriminator_batch_size": 256,
      "gradient_penalty": 10.0,
      "warm_up": 1000,
      "random_steps": 1000,
      "scheduler": "q_table",
      "xi": 45,
      "scheduler_phi": 0.6,
      "scheduler_temperature": 360.0,
      "scheduler_decay": 0.9995,
      "scheduler_minimum": 0.1,
    }
    config = dataclasses.asdict(LfgpConfig())
    self.assertEqual({name: config[name] for name in table}, table)

  @parameterized.parameters(
    ("batch_size", 0, "an integer above 0"),
    ("batch_size", 2.5, "an integer above 0"),
    ("discount", 1.5, "a number from 0 to 1"),
    ("polyak", 0.0, "a number above 0, at most 1"),
    ("critic_learning_rate", float("nan"), "a number above 0"),
    ("critic_learning_rate", "fast", "a number above 0"),
    ("bfloat16", 1, "True or False"),
    ("scheduler", "greedy", "q_table, weighted_random"),
    ("reward", "airl", "logit, probability"),
    ("actor_trunk", "none", "shared, own"),
    ("discriminator_input", "pixels", "state_action, state"),
    ("discriminator_noise", 0.3, "0 unless standardise"),
    ("discriminator_unseen", "3:6,9", "slices of an observation, such as 3:6"),
    ("discriminator_unseen", "6:3", "slices of an observation, such as 3:6"),
    ("random_steps", -1, "an integer, 0 or more"),
  )
  def test_errors_name_field_value_and_what_is_valid(self, name, value, valid):
    with self.assertRaises(ValueError) as caught:
      LfgpConfig(**{name: value})
    message = str(caught.exception)
    self.assertIn(f"{name} is {value!r}; valid: {valid}", message)

  def test_every_fault_is_listed(self):
    with self.assertRaisesRegex(ValueError, "batch_size.*xi|xi.*batch_size"):
      LfgpConfig(batch_size=0, xi=-1)

  def test_unknown_name_is_refused_with_the_valid_ones(self):
    with self.assertRaisesRegex(ValueError, "no gama; valid: absorbing_flag"):
      LfgpConfig.from_mapping({"gama": 0.9})

  def test_every_field_is_checked(self):
    for field in dataclasses.fields(LfgpConfig):
      with self.assertRaisesRegex(ValueError, field.name):
        LfgpConfig(**{field.name: None})


if __name__ == "__main__":
  absltest.main()
