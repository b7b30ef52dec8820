"""The fast update against the equations, task by task, by plain autograd."""

import itertools

import numpy as np
import torch
from absl.testing import parameterized
from torch.nn import functional

from lfgp_dmc import seeding
from lfgp_dmc.agents.batches import Draw
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.networks.trunk import Standardiser
from tests.agents import fixtures

TASKS = ("main", "first", "second")
K, OBS, A, H, B, N = len(TASKS), 59, 4, 32, 24, 16
GAMMA, LAMBDA = 0.99, 10.0


def _learner(**fields):
  """Steps too small to move a float, so that all losses meet one state."""
  rates = (
    "critic.learning_rate",
    "intention.learning_rate",
    "intention.temperature_learning_rate",
    "reward.learning_rate",
  )
  learner = fixtures.make_learner(
    TASKS,
    sizes=(OBS, A),
    **{
      "batch_size": B,
      "intention.initial_temperature": 0.3,
      "networks.hidden_size": H,
      "optimiser.max_gradient_norm": 1e9,
      "reward.batch_size": N,
    },
    **dict.fromkeys(rates, 1e-30),
    **fields,
  )
  with torch.no_grad():  # keeps the target apart from the online network
    for parameter in learner.networks.target_critics.parameters():
      parameter.mul_(1.3)
  return learner


def _linear(inputs, layer):
  return functional.linear(inputs, layer.weight, layer.bias)


def _own(inputs, layer, k):
  return inputs @ layer.weight[k] + layer.bias[k]


class Plain:
  """What the paper's equations say, one task and one critic at a time."""

  def __init__(self, networks, generator):
    self.networks = networks
    self.noise = generator

  def discriminator(self, pairs):
    n = self.networks.discriminator
    hidden = torch.tanh(_linear(pairs, n.first))
    return _linear(torch.tanh(_linear(hidden, n.second)), n.output)

  def discriminator_loss(self, policy, expert, noise):
    share = torch.rand((K, N, policy.shape[1]), generator=noise)
    loss, norms = 0.0, []
    for k in range(K):
      for sign, pairs in ((1, policy), (-1, expert[k])):
        logits = self.discriminator(pairs)[:, k]
        loss += 0.5 * functional.softplus(sign * logits).mean()
      mixed = share[k] * policy[:N] + (1 - share[k]) * expert[k]
      mixed.requires_grad_()
      (gradient,) = torch.autograd.grad(
        self.discriminator(mixed).sum(), mixed, create_graph=True
      )
      norms.append(gradient.norm(dim=1))
    return loss / K + LAMBDA * (torch.cat(norms) - 1).square().mean()

  def trunk(self, module, state):
    if not list(module.parameters()):
      return state
    for layer in (module.first, module.second):
      state = torch.relu(_linear(state, layer))
    return state

  def intention(self, k, state, noise):
    network = self.networks.intentions
    heads, hidden = network.heads, self.trunk(network.trunk, state)
    if not network.owns_trunk:
      hidden = hidden.detach()
    for layer in (heads.hidden, heads.second):
      if layer is not None:
        hidden = torch.relu(_own(hidden, layer, k))
    out = _own(hidden, heads.output, k)
    mean, std = out[:, :A], functional.softplus(out[:, A:]) + 1e-7
    value = mean + std * noise
    density = torch.distributions.Normal(mean, std).log_prob(value)
    correction = 2 * (np.log(2) - value - functional.softplus(-2 * value))
    return torch.tanh(value), (density - correction).sum(1)

  def q(self, critics, twin, k, state, action):
    heads, g = critics.heads, twin * K + k
    features = self.trunk(critics.trunk, state)
    weight = torch.cat([heads.feature_weight[g], heads.action_weight[g]])
    hidden = torch.cat([features, action], 1) @ weight + heads.bias[g]
    if heads.second is not None:
      hidden = _own(torch.relu(hidden), heads.second, g)
    if heads.gain is not None:
      hidden = functional.layer_norm(hidden, (H,))
      hidden = hidden * heads.gain[g] + heads.shift[g]
    return _own(torch.relu(hidden), heads.output, g)[:, 0]

  def critic_loss(self, batch):
    noise = torch.randn((K, B, A), generator=self.noise)
    critics, target = self.networks.critics, self.networks.target_critics
    loss = 0.0
    for k in range(K):
      with torch.no_grad():
        alpha = self.networks.log_temperature[k].exp()
        action, log_prob = self.intention(k, batch.next_inputs, noise[k])
        value = torch.minimum(
          *(self.q(target, i, k, batch.next_inputs, action) for i in range(2))
        )
        pairs = torch.cat([batch.inputs, batch.action], 1)
        reward = self.discriminator(pairs)[:, k]
        wanted = reward + GAMMA * (value - alpha * log_prob)
      for twin in range(2):
        q = self.q(critics, twin, k, batch.inputs, batch.action)
        loss += (q - wanted).square().mean()
    return loss

  def intention_losses(self, state):
    noise = torch.randn((K, B, A), generator=self.noise)
    policy = temperature = 0.0
    for k in range(K):
      alpha = self.networks.log_temperature[k].exp()
      action, log_prob = self.intention(k, state, noise[k])
      value = torch.minimum(
        *(self.q(self.networks.critics, i, k, state, action) for i in range(2))
      )
      policy += (alpha.detach() * log_prob - value).mean()
      temperature += (-alpha * (log_prob.detach() - 4.0)).mean()
    return policy, temperature


class PlainUpdateTest(parameterized.TestCase):
  @parameterized.parameters(
    {},
    {"networks.layout": "separate"},
    {"networks.actor_trunk": "own", "networks.critic_layer_norm": True},
    {"threads": 2},
  )
  def test_losses_and_gradients_equal_the_equations(self, **fields):
    learner = _learner(**fields)
    networks = learner.networks
    batch, other = (fixtures.batch(B, seed, (OBS, A)) for seed in (0, 1))
    shown = fixtures.demonstrations(TASKS, OBS, A)
    pool = ExpertPool(shown, TASKS, Standardiser(OBS))
    expert = pool.sample(np.random.default_rng(0), N)
    noise = torch.Generator().manual_seed(seeding.derive(0, "noise"))
    plain = Plain(networks, noise)
    policy_pairs = torch.cat([other.inputs, other.action], 1)
    expert_pairs = torch.cat([expert.inputs, expert.action], 2)
    policy = networks.intentions
    if not policy.owns_trunk:
      policy = policy.heads
    parts = {
      "discriminator": list(networks.discriminator.parameters()),
      "critic": list(networks.critics.parameters()),
      "policy": list(policy.parameters()),
      "temperature": [networks.log_temperature],
    }
    other_noise = noise
    if "threads" in fields:  # the second has noise of its own
      seed = int(torch.randint(2**62, (), generator=noise))
      other_noise = torch.Generator().manual_seed(seed)
    # In the order in which the update draws its noise.
    losses = [
      plain.discriminator_loss(policy_pairs, expert_pairs, other_noise),
      plain.critic_loss(batch),
      *plain.intention_losses(batch.inputs),
    ]
    expected = [
      torch.autograd.grad(loss, parameters, retain_graph=True)
      for loss, parameters in zip(losses, parts.values(), strict=True)
    ]
    metrics = learner.update(Draw(batch, other, expert))
    found = metrics["loss/discriminator"] + metrics["loss/gradient_penalty"]
    torch.testing.assert_close(found, losses[0].detach())
    for name, loss in zip(list(parts)[1:], losses[1:], strict=True):
      torch.testing.assert_close(metrics[f"loss/{name}"], loss.detach())
    gradients = [[p.grad for p in group] for group in parts.values()]
    for one, other_one in zip(
      itertools.chain(*gradients), itertools.chain(*expected), strict=True
    ):
      torch.testing.assert_close(one, other_one, rtol=1e-4, atol=2e-5)
