"""Losses against numbers worked out by hand."""

import math

import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import rewards
from lfgp_dmc.agents.losses import (
  behaviour_cloning,
  critic,
  discriminator,
  intention,
)
from lfgp_dmc.agents.networks import tanh_gaussian

LN2, LN3 = math.log(2), math.log(3)


class DiscriminatorLossTest(absltest.TestCase):
  def test_value_and_accuracies(self):
    # softplus(0) = ln 2, softplus(ln 3) = ln 4, softplus(-ln 3) = ln(4 / 3):
    # 0.5 [(0.693147 + 1.386294) / 2 + (0.287682 + 0.693147) / 2].
    loss, metrics = discriminator.discriminator_loss(
      torch.tensor([[0.0, LN3]]), torch.tensor([[LN3, 0.0]])
    )
    self.assertAlmostEqual(loss.item(), 0.765068, places=5)
    self.assertEqual(metrics["accuracy_policy"].tolist(), [0, 0])
    self.assertEqual(metrics["accuracy_expert"].tolist(), [1, 0])

  def test_descent_lowers_policy_logits_and_raises_expert_logits(self):
    policy = torch.zeros(4, 2, requires_grad=True)
    expert = torch.zeros(4, 2, requires_grad=True)
    discriminator.discriminator_loss(policy, expert)[0].backward()
    # d/dl 0.5 mean softplus(l) at 0 = 0.5 * 0.5 / 8.
    torch.testing.assert_close(policy.grad, torch.full((4, 2), 1 / 32))
    torch.testing.assert_close(expert.grad, torch.full((4, 2), -1 / 32))

  def test_penalty_value_and_finite_gradient_at_zero(self):
    gradient = torch.tensor([[[3.0, 4.0], [0.0, 0.0]]], requires_grad=True)
    loss, _ = discriminator.gradient_penalty_loss(gradient, 10.0)
    self.assertAlmostEqual(loss.item(), 10 * (16 + 1) / 2, places=4)
    loss.backward()
    self.assertTrue(torch.isfinite(gradient.grad).all())
    unit = torch.tensor([[[0.6, 0.8]], [[0.0, 1.0]]])
    loss, _ = discriminator.gradient_penalty_loss(unit, 10.0)
    self.assertAlmostEqual(loss.item(), 0.0, places=6)

  def test_mixing_is_element_wise_and_reuses_policy_rows(self):
    policy = torch.tensor([[1.0, 1.0], [2.0, 2.0]])
    expert = torch.zeros(1, 3, 2)
    share = torch.tensor([[[0.5, 0.25], [1.0, 0.0], [1.0, 0.5]]])
    mixed = discriminator.mix(policy, expert, share)
    self.assertEqual(mixed.tolist(), [[[0.5, 0.25], [2.0, 0.0], [1.0, 0.5]]])


class CriticLossTest(absltest.TestCase):
  def test_soft_bellman_target(self):
    target = critic.soft_bellman_target(
      reward=torch.tensor([[1.0], [2.0]]),
      next_q=torch.tensor([[[3.0], [4.0]], [[5.0], [1.0]]]),
      next_log_prob=torch.tensor([[-1.0], [2.0]]),
      temperature=torch.tensor([0.5, 0.1]),
      discount=0.9,
    )
    # 1 + 0.9 (3 + 0.5); 2 + 0.9 (1 - 0.2).
    torch.testing.assert_close(target, torch.tensor([[4.15], [2.72]]))

  def test_sums_tasks_and_critics_and_averages_rows(self):
    q = torch.tensor([[[1.0, 2.0], [1.0, 2.0]], [[0.0, 4.0], [2.0, 2.0]]])
    target = torch.full((2, 2), 2.0)
    loss, metrics = critic.critic_loss(q, target)
    # First critic 0.5 + 0.5, second 4 + 0.
    self.assertAlmostEqual(loss.item(), 5.0)
    self.assertEqual(metrics["q"].tolist(), [1.75, 1.75])
    self.assertEqual(metrics["q_max"].tolist(), [4.0, 2.0])


class PolicyLossesTest(absltest.TestCase):
  def test_intention_loss(self):
    loss, metrics = intention.intention_loss(
      log_prob=torch.tensor([[1.0, 3.0], [0.0, 0.0]]),
      q=torch.tensor([[[2.0, 0.0], [1.0, 1.0]], [[1.0, 5.0], [3.0, 3.0]]]),
      temperature=torch.tensor([0.5, 1.0]),
    )
    # Task 0: ((0.5 - 1) + (1.5 - 0)) / 2; task 1: -1.
    self.assertAlmostEqual(loss.item(), -0.5)
    self.assertEqual(metrics["entropy"].tolist(), [-2.0, 0.0])

  def test_temperature_falls_while_entropy_is_above_the_target(self):
    log_temperature = torch.tensor([LN2], requires_grad=True)
    loss, _ = intention.temperature_loss(
      log_temperature, torch.tensor([[1.0, 3.0]]), target_entropy=-4.0
    )
    self.assertAlmostEqual(loss.item(), 4.0, places=5)  # -2 (2 - 4)
    loss.backward()
    self.assertAlmostEqual(log_temperature.grad.item(), 4.0, places=5)

  def test_behaviour_cloning_sums_dimensions_and_weighs_tasks_equally(self):
    mean = torch.tensor([[[math.atanh(0.5), 0.0]], [[0.0, 0.0]]])
    action = torch.tensor([[[0.0, 1.0]], [[0.0, 0.0]]])
    loss, metrics = behaviour_cloning.behaviour_cloning_loss(mean, action)
    self.assertAlmostEqual(loss.item(), 0.625, places=6)
    torch.testing.assert_close(
      metrics["behaviour_cloning"], torch.tensor([1.25, 0.0])
    )
    weighted, _ = behaviour_cloning.behaviour_cloning_loss(
      mean, action, torch.tensor([2.0, 1.0])
    )
    self.assertAlmostEqual(weighted.item(), 2.5, places=6)

  def test_likelihood_by_hand_and_by_a_library(self):
    # atanh(0.5) = 0.549306; std 0.5; normal density, Jacobian 1 - 0.25.
    mean, std = torch.tensor([[[0.3]]]), torch.tensor([[[0.5]]])
    action = torch.tensor([[[0.5]]])
    loss, metrics = behaviour_cloning.likelihood_loss(mean, std, action)
    by_hand = (
      0.5 * ((0.549306 - 0.3) / 0.5) ** 2
      + math.log(0.5)
      + 0.5 * math.log(2 * math.pi)
      + math.log(0.75)
    )
    self.assertAlmostEqual(loss.item(), by_hand, places=5)
    squashed = torch.distributions.TransformedDistribution(
      torch.distributions.Normal(mean, std),
      [torch.distributions.TanhTransform()],
    )
    expected = -squashed.log_prob(action).sum(-1).mean(-1)
    torch.testing.assert_close(metrics["behaviour_cloning"], expected)

  def test_likelihood_weighs_errors_where_the_expert_is_precise(self):
    mean = torch.zeros(1, 2, 1, requires_grad=True)
    std = torch.tensor([[[0.05], [0.5]]])
    loss, _ = behaviour_cloning.likelihood_loss(
      mean, std, torch.full((1, 2, 1), 0.1)
    )
    loss.backward()
    gradient = mean.grad.flatten()
    self.assertAlmostEqual((gradient[0] / gradient[1]).item(), 100.0, places=3)

  def test_likelihood_is_bounded_at_the_ends_of_actions_and_of_stds(self):
    mean = torch.zeros(1, 2, 1)
    std = torch.tensor([[[1e-7], [0.0179]]])
    ends = torch.tensor([[[1.0], [0.95]]])
    loss, _ = behaviour_cloning.likelihood_loss(mean, std, ends)
    self.assertTrue(torch.isfinite(loss))
    low, _ = behaviour_cloning.likelihood_loss(
      mean[:, :1], std[:, :1], ends[:, :1]
    )
    torch.testing.assert_close(low, loss)

  def test_divergence_by_hand_and_by_a_library(self):
    mean = torch.tensor([[[0.3, 0.0]], [[0.0, 0.0]]])
    std = torch.tensor([[[0.2, 1.0]], [[0.1, 0.3]]])
    prior_mean = torch.tensor([[[0.1, 0.0]], [[0.0, 0.0]]])
    prior_std = torch.tensor([[[0.1, 1.0]], [[0.1, 0.3]]])
    loss, metrics = behaviour_cloning.divergence_loss(
      mean, std, prior_mean, prior_std, torch.tensor([2.0, 5.0])
    )
    by_hand = 0.5 * (4.0 + 4.0 - 1.0) - math.log(2.0)
    torch.testing.assert_close(
      metrics["behaviour_cloning"], torch.tensor([by_hand, 0.0])
    )
    self.assertAlmostEqual(loss.item(), 2.0 * by_hand, places=5)
    expected = torch.distributions.kl_divergence(
      torch.distributions.Normal(mean, std),
      torch.distributions.Normal(prior_mean, prior_std),
    )
    torch.testing.assert_close(
      metrics["behaviour_cloning"], expected.sum(-1).mean(-1)
    )

  def test_divergence_from_a_prior_that_is_very_precise(self):
    # Means: (0.009 / 0.018)^2 = 0.25. Deviations: as precise as the prior, then
    # (0.006 / 0.003)^2 = 4 with ln 2, the prior's own being less than 0.003.
    for std, prior_std, by_hand in (
      (0.01, 0.01, 0.125),
      (0.006, 0.0001, 0.5 * (4.0 + 0.25 - 1.0) - math.log(2.0)),
    ):
      _, metrics = behaviour_cloning.divergence_loss(
        torch.tensor([[[0.009]]]),
        torch.tensor([[[std]]]),
        torch.zeros(1, 1, 1),
        torch.tensor([[[prior_std]]]),
      )
      self.assertAlmostEqual(
        metrics["behaviour_cloning"].item(), by_hand, places=5
      )


class TanhGaussianTest(absltest.TestCase):
  def test_log_density(self):
    # Pre-tanh value 1: -0.125 - ln 2 - 0.918939 - ln(1 - tanh(1)^2), and
    # 1 - tanh(1)^2 = 0.419974.
    action, log_prob = tanh_gaussian.sample(
      torch.tensor([0.0]), torch.tensor([2.0]), torch.tensor([0.5])
    )
    self.assertAlmostEqual(action.item(), 0.761594, places=5)
    self.assertAlmostEqual(log_prob.item(), -0.869524, places=5)

  def test_correction_keeps_its_digits_far_out(self):
    value = tanh_gaussian.log_one_minus_tanh_squared(
      torch.tensor([30.0, -30.0])
    )
    torch.testing.assert_close(value, torch.full((2,), -58.613706))

  def test_density_integrates_to_one(self):
    noise = torch.linspace(-8, 8, 20_001, dtype=torch.float64)[:, None]
    mean = torch.full_like(noise, 0.3)
    action, log_prob = tanh_gaussian.sample(
      mean, torch.full_like(noise, 0.7), noise
    )
    total = torch.trapezoid(log_prob.exp(), action[:, 0])
    self.assertAlmostEqual(total.item(), 1.0, places=4)


class RewardsTest(parameterized.TestCase):
  @parameterized.parameters(
    ("logit", 1.098612),
    ("probability", 0.75),
    ("gail", 1.386294),
    ("log_probability", -0.287682),
  )
  def test_forms_at_d_of_three_quarters(self, form, expected):
    reward = rewards.reward_from_logits(torch.tensor([LN3]), form)
    self.assertAlmostEqual(reward.item(), expected, places=5)

  @parameterized.parameters(*rewards.FORMS)
  def test_expert_like_earns_more(self, form):
    logits = torch.linspace(-5, 5, 21)
    reward = rewards.reward_from_logits(logits, form)
    self.assertTrue((reward.diff() > 0).all())

  def test_clip_comes_before_scale(self):
    reward = rewards.reward_from_logits(
      torch.tensor([-9.0, 9.0]), clip=5.0, scale=0.1
    )
    torch.testing.assert_close(reward, torch.tensor([-0.5, 0.5]))
