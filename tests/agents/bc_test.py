"""Behaviour cloning: the split, the loss by hand, early stop, best weights."""

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.bc import BcConfig, build
from lfgp_dmc.agents.bc.pairs import SplitPairs
from lfgp_dmc.agents.networks.trunk import Standardiser
from tests.agents import fixtures
from tests.agents.fixtures import OBS, TASKS, A, make_bc


def _epoch(agent):
  for _ in range(agent.begin_epoch()):
    agent.update()
  agent.end_epoch()


class SplitTest(parameterized.TestCase):
  def _pairs(self, sizes, share=0.3):
    made = {
      task: synthetic.demonstrations((task,), size, OBS, A)[task]
      for task, size in zip(TASKS, sizes, strict=False)
    }
    generator = np.random.default_rng(0)
    return SplitPairs(made, tuple(made), Standardiser(OBS), share, generator)

  def test_is_70_to_30_disjoint_and_whole(self):
    sizes, offset = (100, 50, 10), 0
    pairs = self._pairs(sizes)
    parts = (pairs.train_rows, pairs.validation_rows)
    for size, train, held_out in zip(sizes, *parts, strict=True):
      self.assertLen(held_out, round(0.3 * size))
      self.assertEmpty(set(train) & set(held_out))
      own = set(range(offset, offset + size))
      self.assertEqual(set(train) | set(held_out), own)
      offset += size

  def test_both_parts_always_have_a_row(self):
    pairs = self._pairs((2,), share=0.01)
    self.assertLen(pairs.train_rows[0], 1)
    self.assertLen(pairs.validation_rows[0], 1)
    with self.assertRaisesRegex(ValueError, "fewer than 2 pairs of stack"):
      self._pairs((1,))

  def test_an_epoch_has_every_training_row(self):
    pairs = self._pairs((100, 50))
    order = pairs.shuffled(np.random.default_rng(1), 16)
    self.assertEqual(order.shape, (5, 2, 16))  # 70 rows, and 10 once more
    large, small = order.swapaxes(0, 1).flatten(1).numpy()
    rows, counts = np.unique(large, return_counts=True)
    np.testing.assert_array_equal(rows, pairs.train_rows[0])
    self.assertEqual((counts == 2).sum(), 10)
    self.assertEqual(len(set(large[:70])), 70)
    np.testing.assert_array_equal(np.unique(small), pairs.train_rows[1])

  def test_each_epoch_has_an_order_of_its_own(self):
    agent, orders = make_bc(), []
    for _ in range(2):
      agent.begin_epoch()
      orders.append(torch.stack(agent._order))
    self.assertFalse(torch.equal(*orders))

  def test_a_batch_holds_each_tasks_own_rows(self):
    pairs = self._pairs((100, 50))
    order = pairs.shuffled(np.random.default_rng(1), 16)
    batch = pairs.batch(order[3])
    made = synthetic.demonstrations(("reach",), 50, OBS, A)["reach"]
    rows = order[3, 1].numpy() - 100
    np.testing.assert_array_equal(batch.inputs[1], made.observation[rows])
    np.testing.assert_array_equal(batch.action[1], made.action[rows])


class LossTest(absltest.TestCase):
  def test_losses_are_of_their_own_rows_and_the_mean_over_tasks(self):
    """Of each task the mean over rows of the sum over the action."""
    agent = make_bc(batch_size=10, learning_rate=1e-30)
    _epoch(agent)
    metrics, made = agent.metrics(), fixtures.demonstrations()
    for part in ("train", "validation"):
      by_task = []
      for index, task in enumerate(TASKS):
        rows = getattr(agent._pairs, f"{part}_rows")[index] - 100 * index
        shown = agent.policy.act(made[task].observation[rows], task)
        by_task.append(np.square(shown - made[task].action[rows]).sum(1).mean())
        found = metrics[f"loss_{part}/{task}"]
        self.assertAlmostEqual(found, by_task[-1], places=5)
      found = metrics[f"loss/{part}"]
      self.assertAlmostEqual(found, np.mean(by_task), places=5)

  def test_validation_is_by_the_loss_that_is_trained(self):
    agent, made = make_bc(loss="likelihood"), fixtures.demonstrations()
    heads = agent._network.heads
    heads.set_std(1.0)
    with torch.no_grad():
      heads.output.weight[..., :A] = 0.0
      heads.output.bias[..., :A] = 0.0
    for index, found in enumerate(agent.validation_losses()):
      rows = agent._pairs.validation_rows[index] - 100 * index
      action = made[TASKS[index]].action[rows]
      # N(0, 1) before the tanh: 0.5 v^2 + 0.5 ln(2 pi) + ln(1 - a^2).
      by_float = 0.5 * np.arctanh(action) ** 2 + np.log(1 - action**2)
      by_hand = (by_float + 0.918939).sum(1).mean()
      self.assertAlmostEqual(found, by_hand, places=4)

  def test_the_loss_trains_trunk_and_heads(self):
    agent = make_bc()
    names = {name for name, _ in agent._network.named_parameters()}
    before = fixtures.states(agent._network)
    _epoch(agent)
    self.assertEqual(fixtures.moved(before, agent._network), names)


class EarlyStopTest(absltest.TestCase):
  def test_stops_after_the_tolerance_and_keeps_the_best(self):
    losses = [5.0, 4.0, 4.5, 3.0, 3.0, 3.1, 3.2, 1.0]
    agent = make_bc(("stack",), overfit_tolerance=3)
    for epoch, loss in enumerate(losses, 1):
      with torch.no_grad():
        agent._network.heads.output.bias.fill_(epoch)
      agent.validation_losses = lambda loss=loss: [loss]
      agent.end_epoch()
      if agent.has_converged:
        break
    self.assertEqual(epoch, 7)  # the third after the fourth
    bias = agent.policy.arrays()["heads.output.bias"]
    np.testing.assert_array_equal(bias, np.full_like(bias, 4))
    self.assertEqual(agent.metrics()["loss/best_validation"], 3.0)
    self.assertEqual(agent.metrics()["best_epoch"], 4)

  def test_learns_and_converges_on_synthetic_data(self):
    agent = make_bc(("stack",), overfit_tolerance=5)
    start = np.mean(agent.validation_losses())
    for _ in range(500):
      _epoch(agent)
      if agent.has_converged:
        break
    metrics = agent.metrics()
    self.assertTrue(agent.has_converged)
    self.assertEqual(metrics["epoch"] - metrics["best_epoch"], 5)
    self.assertLess(metrics["loss/best_validation"], 0.1 * start)


class ContractTest(parameterized.TestCase):
  @parameterized.parameters(False, True)
  def test_resumes_to_the_same_numbers(self, bfloat16):
    agent = make_bc(bfloat16=bfloat16)
    other = make_bc(seed=3, bfloat16=bfloat16)
    for _ in range(2):
      _epoch(agent)
    other._pairs = agent._pairs  # the split follows from the seed
    other.load_state_dict(fixtures.reloaded(agent.state_dict()))
    for one in (agent, other):
      for _ in range(2):
        _epoch(one)
    self.assertEqual(agent.metrics(), other.metrics())
    fixtures.assert_same_policy(agent, other)

  def test_network_split_and_order_follow_from_the_seed(self):
    first, again, other = (make_bc(seed=seed) for seed in (3, 3, 4))
    for part in (
      lambda agent: agent.policy.arrays()["heads.output.bias"],
      lambda agent: agent._pairs.validation_rows[0],
      lambda agent: agent._shuffling.bit_generator.state["state"]["state"],
    ):
      np.testing.assert_array_equal(part(first), part(again))
      self.assertFalse(np.array_equal(part(first), part(other)))

  def test_the_share_of_validation_is_the_configs(self):
    pairs = make_bc(validation_share=0.5)._pairs
    self.assertEqual([*map(len, pairs.validation_rows)], [50] * len(TASKS))

  def test_metrics_keep_their_names(self):
    agent = make_bc()
    first = agent.metrics()
    _epoch(agent)
    later = agent.metrics()
    self.assertEqual(list(first), list(later))
    self.assertIn("loss_validation/lift", first)
    self.assertTrue(all(np.isfinite(list(later.values()))))

  @parameterized.parameters(
    {"inputs.standardise": True},
    {"inputs.tanh_feature_scale": 0.01},
    {"bfloat16": True},
    {"loss": "likelihood"},
    {"optimiser.weight_decay": 0.01},
    {"optimiser.max_gradient_norm": 0.01},
  )
  def test_every_option_changes_finite_numbers(self, **fields):
    losses = []
    for agent in (make_bc(), make_bc(**fields)):
      _epoch(agent)
      losses.append(agent.metrics()["loss/validation"])
    self.assertTrue(np.isfinite(losses).all())
    self.assertNotEqual(*losses)

  def test_other_sizes_are_refused(self):
    shown = fixtures.demonstrations()
    with self.assertRaisesRegex(ValueError, "the environment has \\(3, 2\\)"):
      build(BcConfig(), fixtures.parts(TASKS, shown, sizes=(3, A)))
