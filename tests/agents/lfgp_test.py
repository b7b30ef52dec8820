"""The LfGP agent on synthetic data: learning, determinism, resuming."""

import json
import math

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp import LfgpConfig, build
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.runs import pytree
from lfgp_dmc.types import Episode

TASKS = ("stack", "open_gripper", "close_gripper", "reach", "lift")
TASKS = (*TASKS, "move_object")
OBS, A = 10, 4


def _build(seed=0, tasks=TASKS, **fields):
  settings = {
    "hidden_size": 32,
    "batch_size": 32,
    "discriminator_batch_size": 32,
    "random_steps": 5,
    "xi": 5,
    "episode_steps": 20,
  }
  return build(
    LfgpConfig(**(settings | fields)),
    tasks,
    synthetic.demonstrations(tasks, 200, OBS, A),
    synthetic.ArrayReplay(synthetic.transitions(500, OBS, A)),
    seed,
    "cpu",
    OBS,
    A,
  )


def _live(agent, episodes=1, steps=20):
  """Plays on made-up observations, with an update a step; the actions."""
  observations = synthetic.transitions(steps, OBS, A, seed=5).observation
  actions = []
  for _ in range(episodes):
    agent.begin_episode()
    played = np.stack([_step(agent, row) for row in observations])
    agent.end_episode(Episode(observations, played))
    actions.append(played)
  return np.concatenate(actions)


def _step(agent, row):
  action = agent.act(row)
  agent.update()
  return action


class LearningTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    torch.set_num_threads(1)

  def test_discriminator_learns_and_all_stays_finite(self):
    agent = _build(discriminator_learning_rate=3e-3)
    for _ in range(5):
      agent.update()
    early = agent.metrics()
    for _ in range(200):
      agent.update()
    agent.metrics()
    for _ in range(20):
      agent.update()
    late = agent.metrics()
    for task in TASKS:
      self.assertGreater(late[f"accuracy_expert/{task}"], 0.9)
      self.assertGreater(late[f"accuracy_policy/{task}"], 0.65)
      rise = sum(
        late[f"accuracy_{side}/{task}"] - early[f"accuracy_{side}/{task}"]
        for side in ("expert", "policy")
      )
      self.assertGreater(rise, 0.2)
      self.assertGreater(
        late[f"logit_expert/{task}"], late[f"logit_policy/{task}"]
      )
    self.assertLess(late["loss/discriminator"], early["loss/discriminator"])
    off = (
      "scheduler/",
      "loss/behaviour",
      "behaviour",
      "loss/value",
      "value_",
      "distance",
    )
    for name, value in late.items():
      if not name.startswith(off):
        self.assertTrue(math.isfinite(value), name)

  def test_what_looks_like_the_expert_earns_more(self):
    agent = _build(discriminator_learning_rate=3e-3)
    for _ in range(100):
      agent.update()
    demonstrations = synthetic.demonstrations(TASKS, 200, OBS, A)
    other = synthetic.transitions(200, OBS, A, seed=9)
    learner = agent.learner
    for index, task in enumerate(TASKS):
      expert = learner.rewards(
        torch.from_numpy(demonstrations[task].observation),
        torch.from_numpy(demonstrations[task].action),
      )[index]
      policy = learner.rewards(
        torch.from_numpy(other.observation), torch.from_numpy(other.action)
      )[index]
      self.assertGreater(expert.mean().item(), policy.mean().item())

  def test_warm_start_imitates_and_shares_its_trunk(self):
    agent = _build(bc_warm_start_updates=300, bc_learning_rate=3e-3)
    part = synthetic.demonstrations(TASKS, 200, OBS, A)["reach"]
    before = np.square(
      agent.policy.act(part.observation, "reach") - part.action
    )
    agent.prepare()
    after = np.square(agent.policy.act(part.observation, "reach") - part.action)
    self.assertLess(after.mean(), 0.2 * before.mean())
    networks = agent.learner.networks
    for critics in (networks.critics, networks.target_critics):
      torch.testing.assert_close(
        critics.trunk.state_dict(),
        networks.intentions.trunk.state_dict(),
        rtol=0,
        atol=0,
      )
    self.assertEqual(agent.updates, 0)


class ContractTest(parameterized.TestCase):
  def test_metrics_have_the_contracts_names_from_the_first_row(self):
    agent = _build()
    agent.begin_episode()
    agent.act(np.zeros(OBS, np.float32))
    first = agent.metrics()
    names = ["loss/discriminator", "loss/critic", "loss/policy"]
    names += ["loss/temperature"]
    for name in ("accuracy_expert", "accuracy_policy", "reward", "q"):
      names += [f"{name}/{task}" for task in TASKS]
    for name in ("temperature", "entropy", "scheduler"):
      names += [f"{name}/{task}" for task in TASKS]
    self.assertContainsSubset(names, first)
    self.assertTrue(math.isnan(first["loss/critic"]))
    self.assertEqual(sum(first[f"scheduler/{t}"] for t in TASKS), 1.0)
    agent.update()
    self.assertEqual(list(agent.metrics()), list(first))

  def test_scheduler_chooses_every_xi_steps_also_while_random(self):
    agent = _build(xi=5, random_steps=1000)
    agent.begin_episode()
    chosen = []
    for _ in range(20):
      action = agent.act(np.zeros(OBS, np.float32))
      chosen.append(agent.task)
      self.assertEqual(action.dtype, np.float32)
    for start in range(0, 20, 5):
      self.assertLen(set(chosen[start : start + 5]), 1)
    self.assertAlmostEqual(
      agent._scheduler.temperature, 360 * 0.9995**4, places=6
    )

  def test_scheduler_learns_the_main_tasks_discounted_return(self):
    agent = _build(xi=10, discount=0.5, scheduler_phi=1.0)
    rows = synthetic.transitions(20, OBS, A, seed=5)
    agent.begin_episode()
    chosen = []
    for row in rows.observation:
      agent.act(row)
      chosen.append(TASKS.index(agent.task))
    agent.end_episode(Episode(rows.observation, rows.action))
    reward = agent.learner.rewards(
      torch.from_numpy(rows.observation), torch.from_numpy(rows.action)
    )[0]
    expected = sum(reward[10 + t].item() * 0.5**t for t in range(10))
    value = agent._scheduler.value([chosen[0], chosen[10]])
    self.assertAlmostEqual(value, expected, places=5)

  def test_stored_policy_acts_like_the_agents(self):
    agent = _build(standardise=True)
    _live(agent)
    stored = Policy.from_arrays(agent.policy_arrays(), agent.policy_options())
    rows = synthetic.transitions(3, OBS, A).observation
    np.testing.assert_array_equal(
      stored.act(rows, "lift"), agent.policy.act(rows, "lift")
    )

  def test_single_task_runs(self):
    agent = _build(tasks=("reach",), scheduler="main_only")
    _live(agent)
    self.assertEqual(agent.metrics()["scheduler/reach"], 1.0)

  @parameterized.parameters(
    {"scheduler": "weighted_random_handcrafted"},
    {"expert_share": 0.25, "expert_share_decay": 0.9},
    {"discriminator_every": 3},
    {"discriminator_final_share": 0.5},
    {"bc_weight": 1.0, "discriminator_every": 2},
  )
  def test_options_run(self, **fields):
    agent = _build(**fields)
    _live(agent)
    self.assertTrue(math.isfinite(agent.metrics()["loss/critic"]))

  def test_expert_share_puts_expert_rows_into_the_batch(self):
    agent = _build(expert_share=0.25)
    batch = agent.batches.draw(0).batch
    rows = {
      row.tobytes()
      for part in synthetic.demonstrations(TASKS, 200, OBS, A).values()
      for row in part.observation
    }
    found = [row.tobytes() in rows for row in batch.inputs.numpy()]
    self.assertEqual(sum(found), 8)

  def test_unseen_floats_earn_nothing_at_either_scale(self):
    agent = _build(
      discriminator_unseen="1:3", discriminator_input="state", fine_scale=0.1
    )
    raw, action = torch.zeros(1, OBS), torch.zeros(1, A)
    standardiser = agent.learner.networks.intentions.standardiser
    rewards = [agent.learner.rewards(standardiser(raw), action)]
    for at in (2, 3):
      raw[:, at] = 1.0
      rewards.append(agent.learner.rewards(standardiser(raw), action))
    torch.testing.assert_close(rewards[1], rewards[0])
    self.assertFalse(torch.equal(rewards[2], rewards[0]))
    with self.assertRaisesRegex(ValueError, "9:11; the observation has 10"):
      _build(discriminator_unseen="9:11")

  def test_wrong_sizes_are_refused(self):
    with self.assertRaisesRegex(ValueError, "demonstrations of stack.*floats"):
      build(
        LfgpConfig(),
        TASKS,
        synthetic.demonstrations(TASKS, 5, OBS + 1, A),
        synthetic.ArrayReplay(synthetic.transitions(5, OBS, A)),
        0,
        "cpu",
        OBS,
        A,
      )


class DeterminismTest(parameterized.TestCase):
  def test_same_seed_same_numbers(self):
    first, second, other = _build(3), _build(3), _build(4)
    actions = _live(first)
    np.testing.assert_array_equal(actions, _live(second))
    np.testing.assert_equal(first.metrics(), second.metrics())
    self.assertGreater(np.abs(actions - _live(other)).max(), 1e-3)

  @parameterized.parameters(
    {},
    {"actor_trunk": "own", "weight_decay": 0.01, "standardise": True},
    {"bc_warm_start_updates": 3, "expert_share": 0.1},
  )
  def test_resumed_agent_goes_on_bit_for_bit(self, **fields):
    agent = _build(3, **fields)
    _live(agent, episodes=2)
    arrays, tree = pytree.pack(agent.state_dict())
    state = pytree.unpack(arrays, json.loads(json.dumps(tree)))
    resumed = _build(8, **fields)
    resumed.load_state_dict(state)
    np.testing.assert_array_equal(_live(agent, 2), _live(resumed, 2))
    np.testing.assert_equal(agent.metrics(), resumed.metrics())
    for name, array in agent.policy_arrays().items():
      np.testing.assert_array_equal(array, resumed.policy_arrays()[name])

  def test_state_is_a_copy(self):
    agent = _build()
    state = agent.state_dict()
    name = "heads.output.bias"
    before = state["learner"]["networks"]["intentions"][name].copy()
    agent.update()
    np.testing.assert_array_equal(
      state["learner"]["networks"]["intentions"][name], before
    )


if __name__ == "__main__":
  absltest.main()
