"""The value penalty: by hand, its bounds, and what it holds back."""

import math

import numpy as np
import torch
from absl.testing import absltest

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp.example_reward import ExampleBounds
from lfgp_dmc.agents.losses.critic import critic_loss, value_penalty_loss
from lfgp_dmc.agents.value_bounds import ValueBounds
from tests.agents import fixtures
from tests.agents.fixtures import OBS, A

_CPU = torch.device("cpu")


class LossTest(absltest.TestCase):
  def test_by_hand(self):
    q = torch.tensor([[[1.0, 5.0], [-3.0, 0.0]], [[2.0, 2.0], [0.0, 0.0]]])
    low = torch.tensor([[-1.0], [-1.0]])
    high = torch.tensor([[2.0], [2.0]])
    loss, metrics = value_penalty_loss(q, low, high, 10.0)
    # Beyond the bounds by 3 and by 2, each in a mean over two rows.
    self.assertAlmostEqual(loss.item(), 10 * (9 / 2 + 4 / 2), places=4)
    self.assertEqual(metrics["value_low"].tolist(), [-1.0, -1.0])
    mask = torch.tensor([[1.0, 0.0], [1.0, 1.0]])
    loss, _ = value_penalty_loss(q, low, high, 10.0, mask)
    self.assertAlmostEqual(loss.item(), 10 * 4 / 2, places=4)

  def test_masked_rows_count_for_nothing(self):
    q = torch.tensor([[[1.0, 9.0]], [[2.0, 9.0]]])
    target = torch.zeros(1, 2)
    loss, _ = critic_loss(q, target, torch.tensor([[1.0, 0.0]]))
    self.assertAlmostEqual(loss.item(), 1.0 + 4.0)


def _of(bounds, rewards):
  return bounds(torch.tensor(rewards), torch.zeros(1, 2))


class BoundsTest(absltest.TestCase):
  def test_medians_over_a_window(self):
    bounds = ValueBounds(1, 3, 0.9, _CPU)
    seen = []
    for most in (1.0, 2.0, 9.0, 5.0, 7.0):
      low, high = _of(bounds, [[-2 * most, most]])
      seen.append((low.item(), high.item()))
    expected = [1.0, 1.5, 2.0, 5.0, 7.0]
    expected = np.outer(expected, (-20, 10))
    np.testing.assert_allclose(seen, expected, rtol=1e-4)

  def test_bounds_stay_on_their_sides_of_zero(self):
    bounds = ValueBounds(1, 3, 0.9, _CPU)
    low, high = _of(bounds, [[2.0, 3.0]])
    self.assertAlmostEqual(low.item(), -0.1, places=4)
    self.assertAlmostEqual(high.item(), 30.0, places=4)

  def test_of_examples(self):
    bounds = ExampleBounds(2, 50, 0.99, _CPU)
    own = torch.tensor([[False, True, True], [True, False, False]])
    value = torch.tensor([[0.0, 2.0, 4.0], [1.0, 5.0, 5.0]])
    reward = 0.1 * (2.0 * own.float() - 1.0)
    low, high = bounds(reward, value)
    np.testing.assert_allclose(low, [[-10.0], [-10.0]], rtol=1e-4)
    expected = [[3.0, 10.0, 10.0], [10.0, 1.0, 1.0]]
    np.testing.assert_allclose(high, expected, rtol=1e-4)


class AgentTest(absltest.TestCase):
  def test_the_window_is_the_configs(self):
    agent = fixtures.make_agent(**{"critic.value_penalty_window": 7})
    rows = agent.learner.critics.bounds.state_dict()["rows"]
    self.assertEqual(rows.shape, (7, 2, len(fixtures.TASKS)))

  def test_holds_values_between_the_bounds_and_logs_them(self):
    """The target's entropy term alone drives values out of the bounds."""
    means = {}
    for penalty in (0.0, 10.0):
      rows = synthetic.transitions(200, OBS, A)
      agent = fixtures.make_agent(
        ("reach",),
        shown={},
        replay=synthetic.replay(rows, np.ones((200, 1)), ("reach",)),
        **{
          "critic.learning_rate": 3e-3,
          "critic.polyak": 0.2,
          "critic.value_penalty": penalty,
          "reward.clip": 0.02,
          "reward.kind": "stored",
          "scheduler.kind": "main_only",
        },
      )
      fixtures.train(agent, 200)
      means[penalty] = fixtures.train(agent, 1)
    self.assertTrue(math.isnan(means[0.0]["value_high/reach"]))
    high = means[10.0]["value_high/reach"]
    self.assertAlmostEqual(high, 2.0, places=3)
    self.assertGreater(means[0.0]["q/reach"], high + 1)
    self.assertLess(means[10.0]["q/reach"], high + 0.5)
    self.assertGreater(means[10.0]["loss/value_penalty"], 0.0)
