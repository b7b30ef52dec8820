"""LfgpConfig: the paper's table by default, errors that help."""

from absl.testing import parameterized

from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.fields import positions
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from tests.agents import fixtures


class BcConfigTest(parameterized.TestCase):
  def test_defaults_are_the_papers_table(self):
    table = {
      "batch_size": 256,
      "learning_rate": 3e-4,
      "loss": "squared_error",
      "networks.hidden_size": 256,
      "networks.layout": "separate",
      "optimiser.max_gradient_norm": 0.0,
      "overfit_tolerance": 100,
      "validation_share": 0.3,
    }
    self.assertEqual(BcConfig(**fixtures.nested(table)), BcConfig())


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
    ("batch_size", True, "a valid integer"),
    ("critic.discount", 1.5, "less than or equal to 1"),
    ("critic.polyak", 0.0, "greater than 0"),
    ("critic.learning_rate", float("nan"), "a finite number"),
    ("critic.learning_rate", "fast", "a valid number"),
    ("critic.warmup_updates", -1, "greater than or equal to 0"),
    ("networks.actor_trunk", "none", "'shared' or 'own'"),
    ("reward.form", "airl", "'logit', 'probability'"),
    ("reward.input", "pixels", "'state_action' or 'state'"),
    ("reward.noise", 0.3, "0 unless inputs.standardise is True"),
    ("reward.masked", "3:6,9", "slices of an observation, such as 3:6"),
    ("reward.masked", "6:3", "slices of an observation, such as 3:6"),
    ("reward.kind", "examples", "scheduler.kind is 'q_table'"),
    ("reward.kind", "oracle", "'discriminator', 'stored', 'examples'"),
    ("scheduler.kind", "greedy", "'q_table', 'weighted_random'"),
    ("gama", 0.9, "gama"),
    ("pretraining.updates", 10, "own, if there are pretraining.updates"),
    ("critic.masked", "3:6", "nothing, if networks.actor_trunk is 'shared'"),
    ("critic.revealed", "3:6", "unless networks.layout is 'separate'"),
    ("critic.revealed_after", 10, "if critic.revealed .* else 0"),
  )
  def test_errors_say_what_is_valid(self, name, value, valid):
    with self.assertRaisesRegex(ValueError, valid):
      fixtures.config(**{name: value})

  @parameterized.parameters(
    ({}, False),
    ({"inputs.standardise": True}, True),
    ({"networks.actor_trunk": "own", "pretraining.updates": 1}, True),
  )
  def test_what_needs_demonstrations_beside_stored_rewards(self, fields, does):
    config = fixtures.config(**{"reward.kind": "stored", **fields})
    self.assertEqual(config.uses_demonstrations, does)

  def test_slices_name_all_their_places(self):
    self.assertEqual(positions("3:6,53:55"), (3, 4, 5, 53, 54))
    self.assertEqual(positions(""), ())

  @parameterized.parameters(
    ("reward.share is 1.0", {"reward.kind": "examples", "reward.share": 1.0}),
    ("expert_share", {"reward.kind": "stored", "reward.expert_share": 0.1}),
    ("phi", {"scheduler.phi": 0.5}),
    ("final_share is 0.01; valid: 0, or", {"reward.final_share": 0.01}),
    (
      "expert_share is 1.0; valid: one that leaves rows",
      {"reward.expert_share": 1.0, "reward.intentions_on_experts": False},
    ),
    (
      "what critic.masked .3:6. leaves",
      {
        "networks.layout": "separate",
        "critic.masked": "3:6",
        "critic.revealed": "5:7",
        "critic.revealed_after": 10,
      },
    ),
    ("(?s)batch_size.*clip|clip.*batch", {"batch_size": 0, "reward.clip": -1}),
  )
  def test_what_does_not_go_together_and_every_fault(self, message, fields):
    with self.assertRaisesRegex(ValueError, message):
      fixtures.config(**{"scheduler.kind": "uniform", **fields})
