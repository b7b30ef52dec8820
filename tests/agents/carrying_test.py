"""What a new agent takes over from another: exactly what it says."""

import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp import LfgpConfig, build

OLD = ("move_object", "open_gripper", "reach")
NEW = ("stack", "reach", "move_object", "lift")
OBS, A = 6, 2


def _build(tasks, seed, **fields):
  settings = {
    "hidden_size": 16,
    "batch_size": 16,
    "discriminator_batch_size": 16,
    "random_steps": 0,
    "transfer_updates": 3,
  }
  return build(
    LfgpConfig(**(settings | fields)),
    tasks,
    synthetic.demonstrations(tasks, 60, OBS, A, seed=seed, attempt=20),
    synthetic.ArrayReplay(
      synthetic.transitions(100, OBS, A), np.zeros((100, 4)), NEW
    ),
    seed,
    "cpu",
    OBS,
    A,
  )


def _networks(agent):
  return agent.state_dict()["learner"]["networks"]


def _trained(tasks=OLD, **fields):
  agent = _build(tasks, 1, **fields)
  for _ in range(5):
    agent.update()
  return agent


class CarryOverTest(parameterized.TestCase):
  @parameterized.parameters(
    {},
    {"actor_trunk": "own", "critic_layer_norm": True, "standardise": True},
    {"layout": "separate"},
  )
  def test_carries_what_it_says_and_nothing_else(self, **fields):
    source, agent = _trained(**fields), _build(NEW, 2, **fields)
    old, fresh = _networks(source), _networks(agent)
    agent.carry_over(old, OLD)
    new = _networks(agent)
    for network in ("intentions", "critics"):
      for name, array in new[network].items():
        if not name.startswith("heads."):
          np.testing.assert_array_equal(array, old[network][name])
          continue
        twins = len(array) // len(NEW)
        shape = array.shape[1:]
        found = array.reshape(twins, len(NEW), *shape)
        carried = old[network][name].reshape(twins, len(OLD), *shape)
        random = fresh[network][name].reshape(twins, len(NEW), *shape)
        for index, task in enumerate(NEW):
          expected = random[:, index]
          if task in OLD:
            expected = carried[:, OLD.index(task)]
          np.testing.assert_array_equal(found[:, index], expected)
    np.testing.assert_equal(new["target_critics"], new["critics"])
    self._check_discriminator(old, fresh, new)

  def _check_discriminator(self, old, fresh, new):
    old, fresh, new = (part["discriminator"] for part in (old, fresh, new))
    for name, array in new.items():
      if not name.startswith("output."):
        np.testing.assert_array_equal(array, old[name])
    np.testing.assert_array_equal(new["output.bias"], fresh["output.bias"])
    for index, task in enumerate(NEW):
      expected = fresh["output.weight"][index]
      if task in OLD:
        expected = old["output.weight"][OLD.index(task)]
      np.testing.assert_array_equal(new["output.weight"][index], expected)

  def test_temperatures_optimisers_and_scheduler_stay_fresh(self):
    agent, untouched = _build(NEW, 2), _build(NEW, 2)
    agent.carry_over(_networks(_trained()), OLD)
    state, expected = agent.state_dict(), untouched.state_dict()
    for name in ("log_temperature", "optimisers", "updates"):
      np.testing.assert_equal(state["learner"][name], expected["learner"][name])
    np.testing.assert_equal(state["scheduler"], expected["scheduler"])

  @parameterized.parameters((NEW, 3), (OLD, 0))
  def test_a_new_task_makes_updates_before_the_first_step(self, tasks, updates):
    agent = _build(tasks, 2)
    agent.carry_over(_networks(_trained()), OLD)
    agent.prepare()
    agent.prepare()
    self.assertEqual(agent.updates, updates)

  def test_standardisation_comes_along_for_the_demonstrations_too(self):
    source = _trained(standardise=True)
    agent = _build(NEW, 2, standardise=True)
    agent.carry_over(_networks(source), OLD)
    mean = _networks(source)["intentions"]["standardiser.mean"]
    deviation = _networks(source)["intentions"]["standardiser.deviation"]
    pool = agent._experts
    expected = (pool._observation.numpy() - mean) / deviation
    np.testing.assert_allclose(pool._inputs, expected, rtol=1e-5, atol=1e-5)

  def test_without_discriminator_on_either_side(self):
    dense = {"reward_source": "replay"}
    source = _trained(NEW, **dense)
    agent = _build(NEW, 2)
    fresh = _networks(agent)["discriminator"]
    agent.carry_over(_networks(source), NEW)
    np.testing.assert_equal(_networks(agent)["discriminator"], fresh)
    _build(NEW, 3, **dense).carry_over(_networks(_trained()), OLD)

  @parameterized.parameters(
    ({"hidden_size": 8}, r"intentions: .*has shape \[8"),
    ({"layout": "separate"}, "intentions: trunk.*missing"),
    (
      {"discriminator_input": "state"},
      r"discriminator: first.weight has shape",
    ),
  )
  def test_other_sizes_are_refused(self, fields, message):
    with self.assertRaisesRegex(ValueError, message):
      _build(NEW, 2).carry_over(_networks(_trained(**fields)), OLD)

  def test_nothing_in_common_is_refused(self):
    with self.assertRaisesRegex(ValueError, "none of stack.*it has: bring"):
      _build(NEW, 2).carry_over({}, ("bring",))


if __name__ == "__main__":
  absltest.main()
