"""The learner: what each loss moves, targets, options."""

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.demonstration_pool import Batch, ExpertPool
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.learner import LfgpLearner
from lfgp_dmc.agents.lfgp.metric_names import SCALAR_METRICS, TASK_METRICS
from lfgp_dmc.agents.lfgp.networks import make_networks
from lfgp_dmc.agents.networks.trunk import Standardiser

TASKS = ("main", "first", "second")
OBS, A, B = 6, 2, 16
STILL = 1e-30  # a learning rate that changes no float


def _make(**fields):
  config = LfgpConfig(
    **{
      "hidden_size": 16,
      "batch_size": B,
      "discriminator_batch_size": B,
      **fields,
    }
  )
  networks = make_networks(
    config,
    len(TASKS),
    A,
    Standardiser(OBS),
    torch.Generator().manual_seed(1),
    torch.device("cpu"),
  )
  return LfgpLearner(config, networks, torch.Generator().manual_seed(2))


def _batch(seed=0):
  rows = synthetic.transitions(B, OBS, A, seed)
  return Batch(*map(torch.from_numpy, rows))


def _experts():
  demonstrations = synthetic.demonstrations(TASKS, 60, OBS, A)
  return ExpertPool(demonstrations, TASKS, Standardiser(OBS))


def _expert(rows=B):
  return _experts().sample(np.random.default_rng(0), rows)


def _copies(module):
  return {name: tensor.clone() for name, tensor in module.state_dict().items()}


def _moved(before, module):
  return {
    name
    for name, tensor in module.state_dict().items()
    if not torch.equal(before[name], tensor)
  }


class WhatMovesTest(parameterized.TestCase):
  def test_trunk_is_trained_by_the_critic_loss(self):
    learner = _make()
    before = _copies(learner.networks.critics)
    learner.update(_batch(), _batch(1), _expert())
    self.assertEqual(_moved(before, learner.networks.critics), set(before))

  @parameterized.parameters(0.0, 1.0)
  def test_trunk_is_trained_by_nothing_else(self, bc_weight):
    learner = _make(
      critic_learning_rate=STILL,
      intention_learning_rate=0.1,
      bc_weight=bc_weight,
    )
    intentions = _copies(learner.networks.intentions)
    critics = _copies(learner.networks.critics)
    learner.update(_batch(), _batch(1), _expert())
    self.assertEmpty(_moved(critics, learner.networks.critics))
    moved = _moved(intentions, learner.networks.intentions)
    self.assertEqual(moved, {n for n in intentions if n.startswith("heads")})

  def test_own_trunk_is_trained_by_the_intention_loss(self):
    learner = _make(
      actor_trunk="own", critic_learning_rate=STILL, intention_learning_rate=0.1
    )
    intentions = _copies(learner.networks.intentions)
    critics = _copies(learner.networks.critics)
    learner.update(_batch(), _batch(1), _expert())
    self.assertEmpty(_moved(critics, learner.networks.critics))
    moved = _moved(intentions, learner.networks.intentions)
    self.assertIn("trunk.first.weight", moved)

  @parameterized.parameters("shared", "own")
  def test_intention_loss_gives_no_gradient_to_critics(self, trunk):
    learner = _make(actor_trunk=trunk, critic_learning_rate=STILL)
    learner.update(_batch(), _batch(1), _expert())
    learner.networks.critics.zero_grad()
    learner.intentions.update(_batch().inputs, None)
    for parameter in learner.networks.critics.parameters():
      self.assertIsNone(parameter.grad)
      self.assertTrue(parameter.requires_grad)

  def test_target_moves_by_polyak_trunk_included(self):
    learner = _make(polyak=0.25, critic_learning_rate=0.01)
    before = _copies(learner.networks.target_critics)
    learner.update(_batch(), _batch(1), _expert())
    online = learner.networks.critics.state_dict()
    for name, tensor in learner.networks.target_critics.state_dict().items():
      expected = 0.75 * before[name] + 0.25 * online[name]
      torch.testing.assert_close(tensor, expected)
    self.assertIn("trunk.first.weight", before)

  def test_without_its_batch_the_discriminator_stays(self):
    learner = _make()
    before = _copies(learner.networks.discriminator)
    metrics = learner.update(_batch())
    self.assertEmpty(_moved(before, learner.networks.discriminator))
    self.assertNotIn("loss/discriminator", metrics)

  def test_gradient_steps_are_clipped(self):
    learner = _make(max_gradient_norm=1e-3)
    learner.update(_batch(), _batch(1), _expert())
    for module in (learner.networks.critics, learner.networks.intentions.heads):
      norms = [p.grad.norm() for p in module.parameters()]
      total = torch.stack(norms).norm().item()
      self.assertLessEqual(total, 1.001e-3)


class UpdateTest(parameterized.TestCase):
  def test_one_critic_update_equals_the_equations(self):
    """The loss of the first update, composed anew from the networks."""
    learner = _make(discount=0.9)
    networks, batch = learner.networks, _batch()
    with torch.no_grad():  # keeps the target apart from the online network
      for parameter in networks.target_critics.parameters():
        parameter.mul_(1.5)
    noise = torch.randn(
      len(TASKS), B, A, generator=torch.Generator().manual_seed(2)
    )
    with torch.no_grad():
      mean, deviation = networks.intentions(batch.next_inputs)
      value = mean + deviation * noise
      normal = torch.distributions.Normal(mean, deviation)
      log_prob = normal.log_prob(value) - torch.log(1 - value.tanh() ** 2)
      next_q = networks.target_critics(batch.next_inputs, value.tanh())
      pairs = torch.cat([batch.inputs, batch.action], -1)
      reward = networks.discriminator(pairs).t()
      target = reward + 0.9 * (next_q.min(0).values - log_prob.sum(-1))
      q = networks.critics(batch.inputs, batch.action)
      expected = sum(
        ((q[twin, task] - target[task]) ** 2).mean()
        for twin in range(2)
        for task in range(len(TASKS))
      )
    metrics = learner.update(batch)
    self.assertAlmostEqual(
      metrics["loss/critic"].item(), expected.item(), places=3
    )

  def test_rewards_come_from_the_discriminator_just_updated(self):
    learner = _make(discriminator_learning_rate=0.1)
    batch = _batch()
    before = learner.rewards(batch.inputs, batch.action).mean(1)
    metrics = learner.update(batch, _batch(1), _expert())
    after = learner.rewards(batch.inputs, batch.action).mean(1)
    torch.testing.assert_close(metrics["reward"], after)
    self.assertGreater((before - after).abs().max().item(), 1e-3)

  @parameterized.parameters(
    {},
    {"bfloat16": True},
    {"actor_trunk": "own"},
    {"critic_layer_norm": True},
    {"discriminator_input": "state"},
    {"gradient_penalty_per_task": True},
    {"gradient_penalty_mixing": "row"},
    {"absorbing_flag": True},
    {"value_penalty": 10.0},
    {"standardise": True, "discriminator_noise": 0.3},
    {"bc_weight": 1.0, "bc_normalise": True, "bc_decay": 0.5},
    {"weight_decay": 0.01},
    {"reward": "gail", "reward_clip": 1.0, "reward_scale": 0.1},
  )
  def test_every_option_updates_with_finite_numbers(self, **fields):
    learner = _make(**fields)
    for seed in range(3):
      metrics = learner.update(_batch(seed), _batch(seed + 9), _expert())
    for name, value in metrics.items():
      self.assertIn(name, SCALAR_METRICS + TASK_METRICS)
      self.assertTrue(torch.isfinite(value).all(), name)

  def test_bfloat16_stays_near_float32(self):
    losses = []
    for bfloat16 in (False, True):
      learner = _make(bfloat16=bfloat16)
      metrics = learner.update(_batch(), _batch(1), _expert())
      losses.append([metrics[name].item() for name in SCALAR_METRICS[:3]])
    np.testing.assert_allclose(losses[1], losses[0], rtol=0.05, atol=0.05)

  def test_discriminator_needs_expert_pairs(self):
    with self.assertRaisesRegex(ValueError, "needs expert pairs"):
      _make().update(_batch(), _batch(1))


class ExpertPoolTest(absltest.TestCase):
  def test_each_task_draws_its_own_rows(self):
    demonstrations = synthetic.demonstrations(TASKS, 60, OBS, A)
    batch = _expert(rows=200)
    for index, task in enumerate(TASKS):
      own = {row.tobytes() for row in demonstrations[task].observation}
      drawn = {row.tobytes() for row in batch.inputs[index].numpy()}
      self.assertLessEqual(drawn, own)
      self.assertGreater(len(drawn), 40)

  def test_final_rows_are_rows_of_success(self):
    demonstrations = synthetic.demonstrations(TASKS, 100, OBS, A)
    pool = ExpertPool(demonstrations, TASKS, Standardiser(OBS))
    batch = pool.sample(np.random.default_rng(0), 10, final_rows=4)
    for index, task in enumerate(TASKS):
      part = demonstrations[task]
      finals = {row.tobytes() for row in part.observation[part.is_last]}
      for row in batch.inputs[index, 6:].numpy():
        self.assertIn(row.tobytes(), finals)
      for row in batch.inputs[index, :6].numpy():
        self.assertNotIn(row.tobytes(), finals)

  def test_transitions_are_split_with_the_rest_to_the_main_task(self):
    demonstrations = synthetic.demonstrations(TASKS, 60, OBS, A)
    batch = _experts().sample_transitions(np.random.default_rng(0), 11)
    own = {row.tobytes() for row in demonstrations["main"].observation}
    drawn = [row.tobytes() in own for row in batch.inputs.numpy()]
    self.assertEqual(sum(drawn), 5)  # 3 a task and 2 more
    self.assertLen(batch.next_inputs, 11)

  def test_missing_demonstrations_are_named(self):
    with self.assertRaisesRegex(ValueError, "no demonstrations of second"):
      ExpertPool(
        synthetic.demonstrations(TASKS[:2], 5, OBS, A), TASKS, Standardiser(OBS)
      )


if __name__ == "__main__":
  absltest.main()
