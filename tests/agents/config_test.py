"""LfgpConfig: the paper's table by default, errors that help."""

import dataclasses

from absl.testing import parameterized

from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from tests.agents import fixtures


def _fields(kind, prefix=""):
  """Dotted names of all fields, of the default kinds of groups."""
  for field in dataclasses.fields(kind):
    if dataclasses.is_dataclass(field.default):
      yield from _fields(field.default, f"{prefix}{field.name}.")
    else:
      yield f"{prefix}{field.name}"


class LfgpConfigTest(parameterized.TestCase):
  def test_defaults_are_the_papers_table(self):
    table = {
      "batch_size": 256,
      "critic.discount": 0.99,
      "critic.learning_rate": 3e-4,
      "critic.polyak": 0.005,
      "intention.initial_temperature": 1.0,
      "intention.learning_rate": 1e-5,
      "intention.target_entropy": -4.0,
      "intention.temperature_learning_rate": 3e-4,
      "networks.hidden_size": 256,
      "optimiser.max_gradient_norm": 10.0,
      "reward.batch_size": 256,
      "reward.gradient_penalty": 10.0,
      "reward.kind": "discriminator",
      "reward.learning_rate": 3e-4,
      "scheduler.decay": 0.9995,
      "scheduler.kind": "q_table",
      "scheduler.minimum": 0.1,
      "scheduler.phi": 0.6,
      "scheduler.temperature": 360.0,
      "scheduler.xi": 45,
    }
    self.assertEqual(LfgpConfig(**fixtures.nested(table)), LfgpConfig())

  @parameterized.parameters(
    ("batch_size", 0, "greater than or equal to 1"),
    ("batch_size", 2.5, "a valid integer"),
    ("batch_size", True, "a valid integer"),
    ("critic.discount", 1.5, "less than or equal to 1"),
    ("critic.polyak", 0.0, "greater than 0"),
    ("critic.learning_rate", float("nan"), "a finite number"),
    ("critic.learning_rate", "fast", "a valid number"),
    ("critic.warmup_updates", -1, "greater than or equal to 0"),
    ("inputs.standardise", 1, "a valid boolean"),
    ("networks.actor_trunk", "none", "'shared' or 'own'"),
    ("reward.form", "airl", "'logit', 'probability'"),
    ("reward.input", "pixels", "'state_action' or 'state'"),
    ("reward.noise", 0.3, "0 unless inputs.standardise is True"),
    ("reward.masked", "3:6,9", "slices of an observation, such as 3:6"),
    ("reward.masked", "6:3", "slices of an observation, such as 3:6"),
    ("pretraining.updates", 10, "own, if there are pretraining.updates"),
  )
  def test_errors_say_what_is_valid(self, name, value, valid):
    with self.assertRaisesRegex(ValueError, valid):
      fixtures.config(**{name: value})

  @parameterized.parameters(
    ({"reward.kind": "examples"}, "scheduler.kind is 'q_table'"),
    (
      {
        "reward.kind": "examples",
        "reward.share": 1.0,
        "scheduler.kind": "uniform",
      },
      "reward.share is 1.0",
    ),
    ({"reward.kind": "oracle"}, "'discriminator', 'stored', 'examples'"),
    ({"reward.kind": "stored", "reward.expert_share": 0.1}, "expert_share"),
    ({"scheduler.kind": "greedy"}, "'q_table', 'weighted_random'"),
    ({"scheduler.kind": "uniform", "scheduler.phi": 0.5}, "phi"),
    ({"gama": 0.9}, "gama"),
  )
  def test_what_does_not_go_together(self, fields, message):
    with self.assertRaisesRegex(ValueError, message):
      fixtures.config(**fields)

  def test_every_fault_is_listed(self):
    with self.assertRaisesRegex(ValueError, "(?s)batch_size.*xi|xi.*batch_si"):
      fixtures.config(**{"batch_size": 0, "scheduler.xi": -1})

  @parameterized.parameters(LfgpConfig, BcConfig)
  def test_every_field_is_checked(self, kind):
    for name in _fields(kind):
      with self.assertRaisesRegex(ValueError, name.rpartition(".")[2]):
        kind(**fixtures.nested({"reward.kind": "discriminator", name: None}))
