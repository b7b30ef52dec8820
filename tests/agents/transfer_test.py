"""What a new agent takes over from another: exactly what it says."""

import numpy as np
import torch
from absl.testing import parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.networks.flat import in_products
from tests.agents import fixtures
from tests.agents.fixtures import OBS, A

OLD = ("move_object", "open_gripper", "reach")
NEW = ("stack", "reach", "move_object", "lift")
_OWN = {"networks.actor_trunk": "own"}


def _agent(tasks, seed=2, **fields):
  rows = synthetic.transitions(100, OBS, A)
  replay = synthetic.replay(rows, np.zeros((100, 4), np.float32), NEW)
  return fixtures.make_agent(tasks, seed, replay=replay, **fields)


def _networks(agent):
  return agent.state_dict()["learner"]["networks"]


def _trained(tasks=OLD, **fields):
  agent = _agent(tasks, 1, **fields)
  fixtures.train(agent, 5)
  return agent


class CarryOverTest(parameterized.TestCase):
  @parameterized.parameters(
    {},
    {**_OWN, "networks.critic_layer_norm": True, "inputs.standardise": True},
    {"networks.layout": "separate"},
  )
  def test_carries_what_it_says_and_nothing_else(self, **fields):
    source, agent = _trained(**fields), _agent(NEW, **fields)
    old, fresh = _networks(source), _networks(agent)
    agent.carry_over(old, OLD)
    new = _networks(agent)
    by_task = {"intentions": "heads.", "critics": "heads."}
    by_task["discriminator"] = "output."
    for network, prefix in by_task.items():
      for name, array in new[network].items():
        before, random = old[network][name], fresh[network][name]
        if not name.startswith(prefix):
          np.testing.assert_array_equal(array, before)
        elif name == "output.bias":  # the discriminator's stays fresh
          np.testing.assert_array_equal(array, random)
        else:
          self._check_heads(array, before, random)
    np.testing.assert_equal(new["target_critics"], new["critics"])

  def _check_heads(self, found, carried, fresh):
    for twin in range(len(found) // len(NEW)):
      for index, task in enumerate(NEW, twin * len(NEW)):
        expected = fresh[index]
        if task in OLD:
          expected = carried[twin * len(OLD) + OLD.index(task)]
        np.testing.assert_array_equal(found[index], expected)

  def test_the_main_head_comes_along_on_request(self):
    tasks = ("bring", "open_gripper", "reach")
    agent, old = _agent(tasks), _networks(_trained())
    agent.carry_over(old, OLD, 3, main_head=True)
    np.testing.assert_equal(_networks(agent)["intentions"], old["intentions"])
    np.testing.assert_equal(_networks(agent)["critics"], old["critics"])
    agent.prepare()  # the task is new all the same
    self.assertEqual(agent.learner.updates, 3)
    with self.assertRaisesRegex(ValueError, "move_object is a task of this"):
      _agent(NEW).carry_over(old, OLD, main_head=True)

  def test_temperatures_optimisers_and_scheduler_stay_fresh(self):
    agent, untouched = _agent(NEW), _agent(NEW)
    agent.carry_over(_networks(_trained()), OLD)
    state, expected = agent.state_dict(), untouched.state_dict()
    for name in ("log_temperature", "optimisers", "updates"):
      np.testing.assert_equal(state["learner"][name], expected["learner"][name])
    np.testing.assert_equal(state["scheduler"], expected["scheduler"])

  @parameterized.parameters((NEW, 3), (OLD, 0))
  def test_a_new_task_makes_updates_before_the_first_step(self, tasks, updates):
    agent = _agent(tasks)
    agent.carry_over(_networks(_trained()), OLD, 3)
    agent.prepare()
    agent.prepare()
    self.assertEqual(agent.learner.updates, updates)

  def test_standardisation_comes_along_for_the_demonstrations_too(self):
    source = _trained(**{"inputs.standardise": True})
    agent = _agent(NEW, **{"inputs.standardise": True})
    agent.carry_over(_networks(source), OLD)
    started, resumed = (
      _agent(NEW, **_OWN, **{"inputs.standardise": True}) for _ in "ab"
    )
    started.start_from(source.policy)
    resumed.load_state_dict(started.state_dict())
    mean = _networks(source)["intentions"]["standardiser.mean"]
    std = _networks(source)["intentions"]["standardiser.deviation"]
    for pool in (agent._experts, started._experts, resumed._experts):
      expected = (pool._observation.numpy() - mean) / std
      np.testing.assert_allclose(pool._inputs, expected, rtol=1e-5, atol=1e-5)

  def test_products_in_bfloat16_take_over_what_is_carried(self):
    source = _trained()
    carried, started = (_agent(NEW, bfloat16=True, **_OWN) for _ in "ab")
    carried.carry_over(_networks(_trained(**_OWN)), OLD)
    started.start_from(source.policy)
    for agent in (carried, started):
      for name, module in agent.learner.networks.modules().items():
        for parameter in module.parameters():
          copy = in_products(parameter, torch.bfloat16)
          self.assertTrue(copy.equal(parameter.bfloat16()), name)

  def test_floats_that_are_hidden_again_are_revealed_without_a_jump(self):
    fields = {
      "networks.layout": "separate",
      "critic.revealed": "0:2",
      "critic.revealed_after": 2,
      "critic.learning_rate": 0.01,
    }
    source = fixtures.make_agent(seed=1, **fields)
    fixtures.train(source, 10)
    agent = fixtures.make_agent(seed=2, **fields)
    agent.carry_over(_networks(source), source.tasks)
    inputs, critics = torch.randn(3, OBS), agent.learner.networks.critics
    before = critics(inputs, torch.zeros(3, A))
    critics.reveal()
    torch.testing.assert_close(critics(inputs, torch.zeros(3, A)), before)

  def test_without_discriminator_on_either_side(self):
    stored = {"reward.kind": "stored"}
    source = _trained(NEW, **stored)
    agent = _agent(NEW)
    fresh = _networks(agent)["discriminator"]
    agent.carry_over(_networks(source), NEW)
    np.testing.assert_equal(_networks(agent)["discriminator"], fresh)
    _agent(NEW, 3, **stored).carry_over(_networks(_trained()), OLD)

  @parameterized.parameters(
    ({"networks.hidden_size": 8}, r"intentions: .*has shape \[8"),
    ({"networks.layout": "separate"}, "intentions: trunk.*missing"),
    ({"reward.input": "state"}, r"discriminator: first.weight has shape"),
  )
  def test_other_sizes_are_refused(self, fields, message):
    with self.assertRaisesRegex(ValueError, message):
      _agent(NEW).carry_over(_networks(_trained(**fields)), OLD)

  def test_nothing_in_common_is_refused(self):
    with self.assertRaisesRegex(ValueError, "none of stack.*it has: bring"):
      _agent(NEW).carry_over({}, ("bring",))


class InitFromTest(parameterized.TestCase):
  @parameterized.parameters("shared_trunk", "separate")
  def test_intentions_of_common_tasks_act_like_the_policy(self, layout):
    fields = {**_OWN, "inputs.standardise": True, "networks.layout": layout}
    policy = _agent(("reach", "bring"), 1, **fields).policy
    agent = _agent(NEW, **fields)
    rows = synthetic.transitions(5, OBS, A).observation
    before = agent.policy.act(rows, "stack")
    agent.start_from(policy)
    acts = policy.act(rows, "reach")
    np.testing.assert_array_equal(agent.policy.act(rows, "reach"), acts)
    self.assertFalse(np.array_equal(agent.policy.act(rows, "stack"), before))
    networks = agent.learner.networks
    self.assertIsNot(networks.intentions.trunk, networks.critics.trunk)
    agent.prepare()
    agent.update()

  def test_intentions_get_the_std_of_the_config(self):
    agent = _agent(NEW, **_OWN, **{"pretraining.std": 0.1})
    agent.start_from(_trained(**_OWN).policy)
    _, std = agent.learner.networks.intentions(torch.randn(7, OBS))
    torch.testing.assert_close(std, torch.full_like(std, 0.1))

  def test_a_prior_that_is_random_for_new_tasks_is_refused(self):
    policy, own = _agent(("reach", "bring"), 1, **_OWN).policy, _OWN
    prior = {**own, "prior.weight": 1.0}
    with self.assertRaisesRegex(ValueError, "none of stack, move_object, lift"):
      _agent(NEW, **prior).start_from(policy)
    source = _networks(_trained(**own))
    with self.assertRaisesRegex(ValueError, "prior.*none of lift, which would"):
      _agent(NEW, **prior).carry_over(source, OLD, main_head=True)
    _agent(OLD, **prior).carry_over(source, OLD)
    _agent(NEW, **prior, **{"pretraining.updates": 1}).start_from(policy)

  def test_other_sizes_and_tasks_are_refused(self):
    agent = _agent(NEW, **_OWN)
    with self.assertRaisesRegex(ValueError, "the policy has none of stack"):
      agent.start_from(_agent(("bring",)).policy)
    with self.assertRaisesRegex(ValueError, "the policy: .*has shape"):
      agent.start_from(_agent(NEW, **{"networks.hidden_size": 8}).policy)
