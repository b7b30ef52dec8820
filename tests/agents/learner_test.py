"""The learner: what each loss moves, targets, options."""

from unittest import mock

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents.batches import Draw
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp.metric_names import SCALAR_METRICS, TASK_METRICS
from lfgp_dmc.agents.lfgp.second_thread import SecondThread, at_once
from lfgp_dmc.agents.networks.trunk import Standardiser
from tests.agents import fixtures
from tests.agents.fixtures import OBS, TASKS, A, B, make_learner

# The first changes no float.
STILL = {"critic.learning_rate": 1e-30, "intention.learning_rate": 0.1}


def _draw(seed=0):
  expert = fixtures.pool().sample(np.random.default_rng(0), B)
  batch, policy = (fixtures.batch(seed=s) for s in (seed, seed + 9))
  return Draw(batch, policy, expert)


def _flat(learner, copied=False):
  """What critics, intentions, temperatures and discriminators learn."""
  networks = learner.networks
  parts = (
    networks.critics.flat.values,
    networks.intentions.flat.values,
    networks.log_temperature.detach(),
    networks.discriminator.flat.values,
  )
  return [part.clone() for part in parts] if copied else parts


class WhatMovesTest(parameterized.TestCase):
  def test_the_critic_loss_trains_its_trunk_and_a_discriminator_its_own(self):
    learner = make_learner()
    parts = (learner.networks.critics, learner.networks.discriminator)
    critics, discriminator = map(fixtures.states, parts)
    metrics = learner.update(Draw(fixtures.batch()))  # no rows for the second
    self.assertEqual(fixtures.moved(critics, parts[0]), set(critics))
    self.assertEmpty(fixtures.moved(discriminator, parts[1]))
    self.assertNotIn("loss/discriminator", metrics)
    learner.update(_draw())
    moved = fixtures.moved(discriminator, parts[1])
    self.assertEqual(moved, set(discriminator))

  @parameterized.product(
    trunk=("shared", "own"), layout=("shared_trunk", "separate")
  )
  def test_the_intention_loss_trains_heads_and_own_trunk(self, trunk, layout):
    fields = {"networks.actor_trunk": trunk, "networks.layout": layout}
    learner = make_learner(**STILL, **fields)
    networks = learner.networks
    intentions = fixtures.states(networks.intentions)
    critics = fixtures.states(networks.critics)
    learner.update(_draw())
    self.assertEmpty(fixtures.moved(critics, networks.critics))
    moved = fixtures.moved(intentions, networks.intentions)
    heads = {name for name in intentions if name.startswith("heads")}
    self.assertEqual(moved & heads, heads)
    has_own = (trunk, layout) == ("own", "shared_trunk")
    self.assertEqual("trunk.first.weight" in moved, has_own)

  def test_target_moves_by_polyak_trunk_included(self):
    fields = {"critic.polyak": 0.25, "critic.learning_rate": 0.01}
    learner = make_learner(**fields)
    before = fixtures.states(learner.networks.target_critics)
    learner.update(_draw())
    online = learner.networks.critics.state_dict()
    for name, tensor in learner.networks.target_critics.state_dict().items():
      expected = 0.75 * before[name] + 0.25 * online[name]
      torch.testing.assert_close(tensor, expected)
    self.assertIn("trunk.first.weight", before)

  def test_gradient_steps_are_clipped(self):
    learner = make_learner(**{"optimiser.max_gradient_norm": 1e-3})
    learner.update(_draw())
    for module in (learner.networks.critics, learner.networks.intentions.heads):
      norms = torch.stack([p.grad.norm() for p in module.parameters()])
      self.assertLessEqual(norms.norm().item(), 1.001e-3)
    temperature = learner.networks.log_temperature
    self.assertLessEqual(temperature.grad.norm().item(), 1.001e-3)

  def test_each_part_steps_at_its_own_rate(self):
    rates = {
      "critic.learning_rate": 1e-3,
      "intention.learning_rate": 2e-3,
      "intention.temperature_learning_rate": 4e-3,
      "reward.learning_rate": 8e-3,
    }
    learner = make_learner(**rates)
    parts, before = _flat(learner), _flat(learner, copied=True)
    learner.update(_draw())
    # Adam's first step is the rate, whatever the gradient's length.
    for part, old, rate in zip(parts, before, rates.values(), strict=True):
      self.assertAlmostEqual((part - old).abs().max().item(), rate, places=5)

  def test_weight_decay_shrinks_all_networks_but_no_temperature(self):
    rate = 1e-3
    learner = make_learner(
      **{
        "critic.learning_rate": rate,
        "intention.initial_temperature": 0.3,
        "intention.learning_rate": rate,
        "intention.temperature_learning_rate": rate,
        "optimiser.weight_decay": 100.0,
        "reward.learning_rate": rate,
      }
    )
    before = _flat(learner, copied=True)
    learner.update(_draw())
    # Shrunk by rate * decay = 0.1; the step itself is no longer than the rate.
    for part, old, kept in zip(
      _flat(learner), before, (0.9, 0.9, 1.0, 0.9), strict=True
    ):
      torch.testing.assert_close(part, kept * old, rtol=0, atol=1.01 * rate)


class UpdateTest(parameterized.TestCase):
  def _rewards_around_an_update(self, threads=1):
    """Means by task: before it, those that it used, and after it."""
    fields = {"reward.learning_rate": 0.1}
    learner, draw = make_learner(threads=threads, **fields), _draw()
    before = learner.reward.label(draw.batch).reward.mean(1)
    used = learner.update(draw)["reward"]
    after = learner.reward.label(draw.batch).reward.mean(1)
    self.assertGreater((before - after).abs().max().item(), 1e-3)
    return before, used, after

  def test_rewards_come_from_the_discriminator_just_updated(self):
    _, used, after = self._rewards_around_an_update()
    torch.testing.assert_close(used, after)

  def test_beside_a_second_thread_rewards_come_from_before_its_step(self):
    start = SecondThread.start
    for does in (start, lambda _, *call: at_once(*call)):  # or without delay
      with mock.patch.object(SecondThread, "start", does):
        before, used, _ = self._rewards_around_an_update(threads=2)
      torch.testing.assert_close(used, before)

  @parameterized.parameters(
    {"critic.value_penalty": 10.0},
    {"inputs.standardise": True, "reward.noise": 0.3},
    {"networks.actor_trunk": "own"},
    {"networks.critic_layer_norm": True},
    {"optimiser.weight_decay": 0.01},
    {"prior.weight": 1.0, "prior.normalise": True, "prior.decay": 0.5},
    {"reward.clip": 0.01},
    {"reward.form": "gail"},
    {"reward.gradient_penalty": 1.0},
    {"reward.gradient_penalty_per_task": True},
    {"reward.input": "state"},
    {"reward.scale": 0.1},
  )
  def test_every_option_changes_finite_numbers(self, **fields):
    learner, plain = make_learner(**fields), make_learner()
    for seed in range(3):
      metrics = learner.update(_draw(seed))
      other = plain.update(_draw(seed))
    for name, value in metrics.items():
      self.assertIn(name, SCALAR_METRICS + TASK_METRICS)
      self.assertTrue(torch.isfinite(value).all(), name)
    self.assertTrue(
      set(metrics) != set(other)
      or any((metrics[name] != other[name]).any() for name in other)
    )

  def test_temperature_and_target_entropy_are_the_configs(self):
    learner = make_learner(
      **{"intention.initial_temperature": 0.5, "intention.target_entropy": -7.0}
    )
    metrics = learner.update(_draw())
    half = torch.full((len(TASKS),), 0.5)
    torch.testing.assert_close(metrics["temperature"], half)
    by_hand = 0.5 * (metrics["entropy"] + 7.0).sum()
    torch.testing.assert_close(metrics["loss/temperature"], by_hand)

  def test_the_discount_is_the_configs(self):
    fields = {"critic.discount": 1e-9, "reward.clip": 1e-9}
    learner, draw = make_learner(**fields), _draw()
    q = learner.networks.critics(draw.batch.inputs, draw.batch.action).detach()
    loss = learner.update(draw)["loss/critic"]  # all targets are 0
    torch.testing.assert_close(loss, q.square().mean(-1).sum())

  def test_the_priors_weight_decays_from_update_to_update(self):
    learner = make_learner(**{"prior.weight": 1.0, "prior.decay": 0.5})
    for expected in (1.0, 0.5, 0.25):
      learner.update(_draw())
      self.assertEqual(learner.prior._faded.item(), expected)

  def test_noise_is_on_the_experts_pairs_and_on_the_policys(self):
    plain, noisy = (
      make_learner(**{"inputs.standardise": True, "reward.noise": noise})
      for noise in (0.0, 0.3)
    )
    metrics, others = plain.update(_draw()), noisy.update(_draw())
    for name in ("logit_expert", "logit_policy"):
      self.assertTrue((metrics[name] != others[name]).all(), name)

  def test_bounds_and_saturation_are_logged_by_hand(self):
    learner, draw = make_learner(), _draw()
    heads = learner.networks.intentions.heads
    heads.set_std(1e-3)
    with torch.no_grad():  # the first task: one float at each end; others: one
      heads.output.weight[..., :A] = 0.0
      heads.output.bias[..., :A] = torch.tensor([-5.0, 0.0])
      heads.output.bias[0, :, :A] = torch.tensor([-5.0, 5.0])
    metrics = learner.update(draw)
    self.assertEqual(metrics["saturation"].tolist(), [1.0, 0.5, 0.5])
    reward = learner.reward.label(draw.batch).reward
    most = reward.abs().amax(1) / (1 - 0.99)
    torch.testing.assert_close(metrics["q_bound"], most)

  def test_bfloat16_stays_near_float32(self):
    losses = []
    for bfloat16 in (False, True):
      metrics = make_learner(bfloat16=bfloat16).update(_draw())
      losses.append([metrics[name].item() for name in SCALAR_METRICS[:3]])
    np.testing.assert_allclose(losses[1], losses[0], rtol=0.05, atol=0.05)
    self.assertNotEqual(*losses)


class ExpertPoolTest(absltest.TestCase):
  def test_each_task_draws_its_own_rows(self):
    shown = fixtures.demonstrations()
    drawn = fixtures.pool().sample(np.random.default_rng(0), 200)
    for index, task in enumerate(TASKS):
      rows = drawn.inputs[index].numpy()
      self.assertTrue(all(fixtures.among(rows, shown[task].observation)))
      self.assertGreater(len(np.unique(rows, axis=0)), 40)

  def test_transitions_are_split_with_the_rest_to_the_main_task(self):
    shown = fixtures.demonstrations()
    drawn = fixtures.pool().sample_transitions(np.random.default_rng(0), 11)
    found = fixtures.among(drawn.inputs, shown[TASKS[0]].observation)
    self.assertEqual(sum(found), 5)  # 3 a task and 2 more
    self.assertLen(drawn.next_inputs, 11)

  def test_transitions_are_whole_rows_of_the_experts(self):
    drawn = fixtures.pool().sample_transitions(np.random.default_rng(0), 50)
    shown = [
      np.hstack([part.observation, part.action, part.next_observation])
      for part in fixtures.demonstrations().values()
    ]
    rows = torch.cat([drawn.inputs, drawn.action, drawn.next_inputs], dim=1)
    self.assertTrue(all(fixtures.among(rows, *shown)))

  def test_missing_demonstrations_are_named(self):
    with self.assertRaisesRegex(ValueError, "no demonstrations of lift"):
      ExpertPool(fixtures.demonstrations(TASKS[:2]), TASKS, Standardiser(OBS))
