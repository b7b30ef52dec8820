"""Networks: initial bounds, stacking, the hand-written derivative."""

import math

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.critics import TwinCriticHeads
from lfgp_dmc.agents.networks.discriminator import Discriminator
from lfgp_dmc.agents.networks.intentions import IntentionHeads, to_std
from lfgp_dmc.agents.networks.trunk import Standardiser, Trunk

K, OBS, A, H, B = 3, 7, 2, 16, 5


def _generator():
  return torch.Generator().manual_seed(0)


class InitialBoundsTest(absltest.TestCase):
  def _check(self, parameter, fan_in):
    bound = 1 / math.sqrt(fan_in)
    largest = parameter.abs().max().item()
    self.assertLessEqual(largest, bound)
    self.assertGreater(largest, 0.9 * bound)

  def test_paper_sizes(self):
    trunk = Trunk(59, 256, _generator())
    heads = IntentionHeads(6, 256, 256, 4, _generator())
    critics = TwinCriticHeads(6, 256, 256, 4, _generator())
    discriminator = Discriminator(6, 59, 4, 256, _generator())
    for parameter, fan_in in (
      (trunk.first.weight, 59),
      (trunk.first.bias, 59),
      (heads.hidden.weight, 256),
      (heads.output.weight, 256),
      (critics.feature_weight, 260),
      (critics.action_weight, 260),
      (critics.bias, 260),
      (critics.output.weight, 256),
      (discriminator.first.weight, 63),
      (discriminator.output.weight, 256),
    ):
      self._check(parameter, fan_in)
    # Each head has the bound of its own fan-in, not of the stack's.
    for head in heads.output.weight:
      self._check(head, 256)
    self.assertEqual(tuple(heads.output.weight.shape), (6, 256, 8))
    self.assertEqual(tuple(critics.output.weight.shape), (12, 256, 1))


class StackingTest(parameterized.TestCase):
  @parameterized.parameters(1, 2)
  def test_one_intention_equals_its_row_of_all(self, layers):
    heads = IntentionHeads(K, H, H, A, _generator(), layers)
    features = torch.randn(B, H, generator=_generator())
    mean, std = heads(features)
    self.assertEqual(tuple(mean.shape), (K, B, A))
    for task in range(K):
      one_mean, one_raw = heads.one(features, task)
      torch.testing.assert_close(one_mean, mean[task])
      torch.testing.assert_close(to_std(one_raw), std[task])

  def test_std_is_softplus_plus_epsilon(self):
    std = to_std(torch.tensor([0.0, -100.0]))
    self.assertAlmostEqual(std[0].item(), math.log(2), places=6)
    self.assertAlmostEqual(std[1].item(), 1e-7, places=12)

  def test_layer_norm_bounds_the_values(self):
    heads = TwinCriticHeads(K, H, H, A, _generator(), layer_norm=True)
    q = heads(torch.full((B, H), 1e6), torch.zeros(B, A))
    bound = heads.output.weight.norm(dim=1).max() * math.sqrt(H) + 1
    self.assertLess(q.abs().max().item(), bound.item())


class SeparateLayoutTest(absltest.TestCase):
  def _shapes(self, module):
    parameters = module.named_parameters()
    return {k: tuple(p.shape) for k, p in parameters if "weight" in k}

  def test_has_the_papers_layers(self):
    sizes = (1, 256, 4, _generator())
    self.assertEqual(
      self._shapes(
        layouts.make_intentions("separate", Standardiser(59), *sizes)
      ),  # 59-256-256-8
      {
        "heads.hidden.weight": (1, 59, 256),
        "heads.second.weight": (1, 256, 256),
        "heads.output.weight": (1, 256, 8),
      },
    )
    self.assertEqual(
      self._shapes(layouts.make_critics("separate", 59, *sizes)),
      {  # 63-256-256-1, twice
        "heads.feature_weight": (2, 59, 256),
        "heads.action_weight": (2, 4, 256),
        "heads.second.weight": (2, 256, 256),
        "heads.output.weight": (2, 256, 1),
      },
    )


def _logits(network, pairs):
  """A discriminator's, by autograd."""
  hidden = torch.tanh(network.first(pairs))
  return network.output(torch.tanh(network.second(hidden)))


class DiscriminatorTest(parameterized.TestCase):
  @parameterized.product(
    inputs=("state_action", "state"), per_task=(False, True)
  )
  def test_hand_written_passes_equal_autograd(self, inputs, per_task):
    network = Discriminator(K, OBS, A, H, _generator(), inputs)
    size = OBS + (A if inputs == "state_action" else 0)
    pairs = torch.randn(5 * B, size, generator=_generator())
    mixed = torch.randn(K, B, size, generator=_generator())

    def plain():
      rows = mixed.clone().requires_grad_()
      logits = _logits(network, rows)
      if per_task:
        logits = logits.diagonal(dim1=0, dim2=2)
      (gradient,) = torch.autograd.grad(logits.sum(), rows, create_graph=True)
      return _logits(network, pairs), gradient

    def gradients(logits, gradient):
      loss = logits.square().mean() + (gradient.norm(dim=-1) - 1).square().sum()
      return torch.autograd.grad(loss, list(network.parameters()))

    expected = plain()
    found = network.logits_and_gradient(pairs, mixed, per_task)
    torch.testing.assert_close(found, expected)
    # The last bias does not move the input gradient, but the logits.
    torch.testing.assert_close(
      gradients(*found), gradients(*expected), rtol=1e-4, atol=1e-5
    )


class StandardiserTest(absltest.TestCase):
  def test_floor_on_the_std(self):
    standardiser, row = Standardiser(2), torch.tensor([[1.5, -2.0]])
    torch.testing.assert_close(standardiser(row), row)  # at first
    standardiser.fit(np.array([[0.0, 5.0], [4.0, 5.0]], np.float32))
    result = standardiser(torch.tensor([[4.0, 5.02]]))
    torch.testing.assert_close(result, torch.tensor([[1.0, 2.0]]))

  def test_tanh_features_follow_and_tell_millimetres_apart(self):
    standardiser = Standardiser(2, tanh_feature_scale=0.01)
    result = standardiser(torch.tensor([[0.002, -1.0]]))
    # tanh(0.2) = 0.197375.
    expected = torch.tensor([[0.002, -1.0, 0.197375, -1.0]])
    torch.testing.assert_close(result, expected)
    self.assertEqual(standardiser.input_size, 4)
    standardiser.fit(np.array([[0.0, -1.0], [4.0, -1.0]], np.float32))
    result = standardiser(torch.tensor([[0.002, -1.0]]))
    # (0.002 - 2) / 2; the tanh is of what is not standardised.
    expected = torch.tensor([[-0.999, 0.0, 0.197375, -1.0]])
    torch.testing.assert_close(result, expected)
