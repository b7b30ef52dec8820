"""DAC: networks of a single task, what trains them, that they learn."""

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.agents.policy import Policy
from tests.agents import fixtures

TASK = "stack"
OBS, A, H = 59, 4, 32


def _agent(**fields):
  fields = {
    "networks.hidden_size": H,
    "networks.layout": "separate",
    "scheduler.kind": "main_only",
    **fields,
  }
  return fixtures.make_agent((TASK,), observations=OBS, actions=A, **fields)


def _heads():
  generator = torch.Generator().manual_seed(0)
  return layouts.make_intentions(
    "separate", Standardiser(OBS), 3, H, A, generator
  ).heads


def _shapes(module):
  return {name: tuple(p.shape) for name, p in module.named_parameters()}


class SeparateNetworksTest(parameterized.TestCase):
  def test_have_the_papers_layers(self):
    networks = _agent(**{"networks.hidden_size": 256}).learner.networks
    self.assertEqual(
      _shapes(networks.intentions),  # 59-256-256-8
      {
        "heads.hidden.weight": (1, 59, 256),
        "heads.hidden.bias": (1, 1, 256),
        "heads.second.weight": (1, 256, 256),
        "heads.second.bias": (1, 1, 256),
        "heads.output.weight": (1, 256, 8),
        "heads.output.bias": (1, 1, 8),
      },
    )
    self.assertEqual(
      _shapes(networks.critics),  # 63-256-256-1, twice
      {
        "heads.feature_weight": (2, 59, 256),
        "heads.action_weight": (2, 4, 256),
        "heads.bias": (2, 1, 256),
        "heads.second.weight": (2, 256, 256),
        "heads.second.bias": (2, 1, 256),
        "heads.output.weight": (2, 256, 1),
        "heads.output.bias": (2, 1, 1),
      },
    )
    first = _shapes(networks.discriminator)["first.weight"]
    self.assertEqual(first, (256, 63))

  def test_critics_equal_plain_networks(self):
    heads = _agent().learner.networks.critics.heads
    inputs, action = torch.randn(5, OBS), torch.randn(5, A)
    for twin in range(2):
      weight = torch.cat(
        [heads.feature_weight[twin], heads.action_weight[twin]]
      )
      hidden = torch.cat([inputs, action], -1) @ weight + heads.bias[twin]
      hidden = torch.relu(hidden) @ heads.second.weight[twin]
      hidden = torch.relu(hidden + heads.second.bias[twin])
      q = hidden @ heads.output.weight[twin] + heads.output.bias[twin]
      torch.testing.assert_close(heads(inputs, action)[twin, 0], q[:, 0])

  @parameterized.parameters("shared", "own")
  def test_each_loss_trains_its_own_network_alone(self, actor_trunk):
    agent = _agent(
      **{"critic.learning_rate": 1e-30, "networks.actor_trunk": actor_trunk}
    )
    networks = agent.learner.networks
    before = {
      name: [p.detach().clone() for p in module.parameters()]
      for name, module in networks.modules().items()
    }
    agent.update()
    for name, moves in (("intentions", True), ("critics", False)):
      for old, new in zip(
        before[name], networks.modules()[name].parameters(), strict=True
      ):
        self.assertEqual(bool((old != new).any()), moves, name)

  def test_one_task_alone_moves_nothing_of_another(self):
    """With K tasks no layer is shared: a gradient stays in its own group."""
    heads = _heads()
    mean, _ = heads(torch.randn(4, OBS))
    mean[1].sum().backward()
    for layer in (heads.hidden, heads.second, heads.output):
      norms = layer.weight.grad.flatten(1).norm(dim=1)
      self.assertEqual((norms > 0).tolist(), [False, True, False])

  def test_one_head_equals_all(self):
    heads = _heads()
    inputs = torch.randn(4, OBS)
    torch.testing.assert_close(heads.one(inputs, 2)[0], heads(inputs)[0][2])


class DacTest(absltest.TestCase):
  def test_discriminator_learns_and_critics_follow(self):
    torch.set_num_threads(1)
    agent = _agent(**{"reward.learning_rate": 3e-3})
    agent.update()
    early = agent.metrics()
    for _ in range(150):
      agent.update()
    agent.metrics()
    for _ in range(20):
      agent.update()
    late = agent.metrics()
    self.assertGreater(late[f"accuracy_expert/{TASK}"], 0.95)
    self.assertGreater(late[f"accuracy_policy/{TASK}"], 0.95)
    self.assertLess(late["loss/discriminator"], early["loss/discriminator"])
    self.assertTrue(np.isfinite(late["loss/critic"]))

  def test_acts_by_its_one_intention_and_resumes(self):
    agent, other = _agent(), _agent()
    agent.begin_episode()
    action = agent.act(np.zeros(OBS, np.float32))
    self.assertEqual((action.shape, agent.task), ((A,), TASK))
    agent.update()
    other.load_state_dict(agent.state_dict())
    agent.update()
    other.update()
    fixtures.assert_same_policy(agent, other)

  def test_policy_folder_acts_the_same(self):
    policy = _agent().policy
    folder = self.create_tempdir().full_path
    policy.save(folder)
    loaded = Policy.load(folder)
    self.assertEqual(loaded.options()["layout"], "separate")
    rows = synthetic.transitions(3, OBS, A).observation
    np.testing.assert_array_equal(loaded.act(rows), policy.act(rows))

  def test_policies_stored_without_a_layout_share_a_trunk(self):
    policy = _agent(**{"networks.layout": "shared_trunk"}).policy
    options = policy.options()
    self.assertEqual(options.pop("layout"), "shared_trunk")
    loaded = Policy.from_arrays(policy.arrays(), options)
    row = np.ones(OBS, np.float32)
    np.testing.assert_array_equal(loaded.act(row), policy.act(row))
    options["layout"] = "fully_connected"
    with self.assertRaisesRegex(ValueError, "layout is 'fully_connected'; val"):
      Policy.from_arrays(policy.arrays(), options)


if __name__ == "__main__":
  absltest.main()
