"""Steps on flat parameters are torch's own, and older moments load."""

import torch
from absl.testing import parameterized
from torch import nn

from lfgp_dmc.agents.networks.flat import FlatParameters, in_products
from lfgp_dmc.agents.optimisation import Adam


def _loss(parameters, target):
  return sum((p - target).square().sum() for p in parameters)


class AdamTest(parameterized.TestCase):
  def _pair(self, decay, max_norm):
    """Ours and torch's, of the same parameters, each with its step."""
    drawn = [torch.randn(3, 2), torch.randn(4)]
    ours, theirs = ([nn.Parameter(x.clone()) for x in drawn] for _ in "ab")
    adam = Adam(FlatParameters(ours, torch.float32), 0.1, decay, max_norm)
    kind = torch.optim.AdamW if decay else torch.optim.Adam
    plain = kind(theirs, 0.1, weight_decay=decay)

    def step(target):
      plain.zero_grad()
      _loss(theirs, target).backward()
      norm = nn.utils.clip_grad_norm_(theirs, max_norm or float("inf"))
      plain.step()
      torch.testing.assert_close(adam.step(_loss(ours, target)), norm)
      torch.testing.assert_close(ours, theirs)

    return adam, plain, step

  @parameterized.parameters((0.0, 0.0), (0.0, 1.0), (0.01, 1.0))
  def test_steps_are_torchs(self, decay, max_norm):
    _, _, step = self._pair(decay, max_norm)
    for target in (1.0, -2.0, 0.5):
      step(target)

  def test_parameters_learn_in_the_dtype_that_they_are_used_in(self):
    wide, narrow, unused = (nn.Parameter(torch.ones(1)) for _ in range(3))
    flat = FlatParameters([wide, narrow, unused], torch.bfloat16)
    copy = in_products(narrow, torch.bfloat16)
    self.assertEqual(copy.dtype, torch.bfloat16)
    gradient = flat.differentiate((3 * wide + 2 * copy).sum())
    self.assertEqual(gradient.tolist(), [3.0, 2.0, 0.0])

  def test_copies_for_products_follow_steps_and_targets(self):
    parameters = [nn.Parameter(torch.ones(2)) for _ in "ab"]
    online, target = (FlatParameters([p], torch.bfloat16) for p in parameters)
    copy, of_target = (in_products(p, torch.bfloat16) for p in parameters)
    Adam(online, 0.5).step((3 * copy).sum())  # at first by the learning rate
    self.assertEqual(copy.tolist(), [0.5, 0.5])
    target.follow(online, 0.25)  # 0.75 + 0.25 * 0.5
    self.assertEqual(of_target.tolist(), [0.875, 0.875])
