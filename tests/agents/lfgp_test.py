"""The LfGP agent on synthetic data: learning, determinism, resuming."""

import functools
import math
import operator
from unittest import mock

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.task_names import task_set
from lfgp_dmc.types import Episode
from tests.agents import fixtures
from tests.agents.fixtures import OBS, A, make_agent

TASKS = task_set("stack")
_LEARNING = {
  "sizes": (10, 4),
  "networks.hidden_size": 32,
  "reward.learning_rate": 3e-3,
}
_PERIODS = {"scheduler.xi": 5}


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


class LearningTest(parameterized.TestCase):
  @parameterized.parameters(
    (TASKS, {}),
    (TASKS, {"reward.main_masked": "0:2", "reward.input": "state"}),
    (
      TASKS[:1],  # DAC
      {"networks.layout": "separate", "scheduler.kind": "main_only"},
    ),
  )
  def test_discriminator_learns_and_all_stays_finite(self, tasks, fields):
    agent = make_agent(tasks, **_LEARNING, **fields)
    early, _, late = (fixtures.train(agent, n) for n in (5, 200, 20))
    for task in tasks:
      self.assertGreater(late[f"accuracy_expert/{task}"], 0.9)
      self.assertGreater(late[f"accuracy_policy/{task}"], 0.65)
      apart = late[f"logit_expert/{task}"] - late[f"logit_policy/{task}"]
      self.assertGreater(apart, 1.0)
    self.assertLess(late["loss/discriminator"], early["loss/discriminator"])
    off = ("scheduler/", "loss/value", "value_", "distance")
    for name, value in late.items():
      if not name.startswith(off):
        self.assertTrue(math.isfinite(value), name)


class ContractTest(parameterized.TestCase):
  def test_metrics_have_the_contracts_names_from_the_first_row(self):
    agent = make_agent(TASKS)
    agent.begin_episode()
    agent.act(np.zeros(OBS, np.float32))
    first = agent.metrics()
    losses = ("discriminator", "critic", "policy", "temperature")
    names = [f"loss/{name}" for name in losses]
    by_task = ("accuracy_expert", "accuracy_policy", "reward", "q",
               "temperature", "entropy", "scheduler")  # fmt: skip
    names += [f"{name}/{task}" for name in by_task for task in TASKS]
    self.assertContainsSubset(names, first)
    self.assertTrue(math.isnan(first["loss/critic"]))
    self.assertEqual(sum(first[f"scheduler/{t}"] for t in TASKS), 1.0)
    agent.update()
    self.assertEqual(list(agent.metrics()), list(first))

  def test_scheduler_chooses_every_xi_steps(self):
    agent = make_agent(TASKS, **_PERIODS)
    chosen = fixtures.chosen(agent, np.zeros((20, OBS), np.float32))
    for start in range(0, 20, 5):
      self.assertLen(set(chosen[start : start + 5]), 1)
    temperature = agent._scheduler.temperature
    self.assertAlmostEqual(temperature, 360 * 0.9995**4, places=6)

  def test_actions_are_samples_of_the_intentions(self):
    agent, row = make_agent(TASKS), np.zeros(OBS, np.float32)
    agent.learner.networks.intentions.heads.set_std(0.5)
    agent.begin_episode()
    values = np.arctanh([agent.act(row) for _ in range(45)])  # of one period
    self.assertBetween(values.std(0).mean(), 0.3, 0.7)

  def test_an_episode_begins_with_a_period_of_its_own(self):
    agent, rows = make_agent(**_PERIODS), np.zeros((7, OBS), np.float32)
    for _ in range(2):  # a period, and two steps of the next one
      fixtures.chosen(agent, rows)
    self.assertLen(agent._scheduler._history, 2)
    self.assertEqual(agent._choices.sum(), 4)

  def test_choices_are_shares_since_the_last_metrics(self):
    agent = make_agent(**{"scheduler.kind": "uniform", "scheduler.xi": 1})
    for _ in range(2):
      chosen = fixtures.chosen(agent, np.zeros((8, OBS), np.float32))
      metrics = agent.metrics()
      for index, task in enumerate(agent.tasks):
        found = metrics[f"scheduler/{task}"]
        self.assertEqual(found, chosen.count(index) / 8)

  def test_metrics_are_means_over_the_updates_that_had_them(self):
    agent, other = (make_agent(**{"reward.every": 2}) for _ in "ab")
    made = [other.learner.update(other.batches.draw(n)) for n in range(3)]
    found = fixtures.train(agent, 3)
    for name, had in (("critic", made), ("discriminator", made[::2])):
      expected = np.mean([one[f"loss/{name}"].item() for one in had])
      self.assertAlmostEqual(found[f"loss/{name}"], expected, places=4)
    last = fixtures.train(agent, 1)
    expected = other.learner.update(other.batches.draw(3))["loss/critic"]
    self.assertAlmostEqual(last["loss/critic"], expected.item(), places=4)
    self.assertTrue(math.isnan(last["loss/discriminator"]))

  def test_scheduler_learns_the_main_tasks_discounted_return(self):
    periods = {"scheduler.phi": 1.0, "scheduler.xi": 10}
    agent = make_agent(**{"critic.discount": 0.5}, **periods)
    rows = synthetic.transitions(20, OBS, A, seed=5)
    chosen = fixtures.chosen(agent, rows.observation)
    agent.end_episode(Episode(rows.observation, rows.action))
    reward = agent.learner.reward.rewards(*map(torch.from_numpy, rows[:2]))[0]
    expected = sum(reward[10 + t].item() * 0.5**t for t in range(10))
    value = agent._scheduler.value(chosen[::10])
    self.assertAlmostEqual(value, expected, places=5)

  def test_stored_policy_acts_like_the_agents(self):
    inputs = {"inputs.standardise": True, "inputs.tanh_feature_scale": 0.1}
    agent = make_agent(**inputs)
    _live(agent)
    folder = self.create_tempdir().full_path
    agent.save_policy(folder, {}, env_step=0)
    stored = Policy.load(folder)
    rows = synthetic.transitions(3, OBS, A).observation
    acts = agent.policy.act(rows, "lift")
    np.testing.assert_array_equal(stored.act(rows, "lift"), acts)

  def test_wrong_sizes_are_refused(self):
    shown = fixtures.demonstrations(TASKS, OBS + 1)
    with self.assertRaisesRegex(ValueError, "demonstrations of stack.*floats"):
      make_agent(shown=shown)


class BatchTest(absltest.TestCase):
  def test_a_discriminator_waits_for_its_turn(self):
    agent = make_agent(**{"reward.every": 3})
    due = [agent.batches.draw(update).policy for update in range(7)]
    self.assertEqual([batch is not None for batch in due],
                     [True, False, False] * 2 + [True])  # fmt: skip

  def test_the_main_task_may_have_a_share_of_its_own(self):
    agent = make_agent()
    split = agent.batches._pool.split
    for share, counts in ((0.0, [12, 10, 10]), (0.5, [16, 8, 8])):
      task = split(32, share)
      self.assertEqual(np.bincount(task).tolist(), counts)
    share = {"reward.expert_share": 0.5, "reward.main_expert_share": 0.5}
    batch = make_agent(**share).batches.draw(0).batch
    for part, count in zip(
      fixtures.demonstrations().values(), (8, 4, 4), strict=True
    ):
      found = fixtures.among(batch.inputs, part.observation)
      self.assertEqual(sum(found), count)

  def test_intentions_may_leave_expert_rows_to_the_critics(self):
    share = {"reward.expert_share": 0.25}
    self.assertIsNone(make_agent(**share).batches.draw(0).replayed)
    agent = make_agent(**share, **{"reward.intentions_on_experts": False})
    draw = agent.batches.draw(0)
    self.assertTrue(draw.batch.inputs[:24].equal(draw.replayed.inputs))
    with mock.patch.object(
      agent.learner.intentions, "update", return_value={}
    ) as update:
      agent.learner.update(draw)
    self.assertIs(update.call_args.args[0], draw.replayed.inputs)

  def test_rows_of_success_come_last_and_in_their_share(self):
    agent = make_agent(**{"reward.final_share": 0.5})
    expert = agent.batches.draw(0).expert
    for index, part in enumerate(fixtures.demonstrations().values()):
      finals = part.observation[part.is_last]
      found = fixtures.among(expert.inputs[index], finals)
      self.assertEqual(found, [False] * 16 + [True] * 16)

  def test_the_last_rows_of_a_whole_attempt_are_of_success(self):
    shown = fixtures.demonstrations()
    cut = shown["reach"].is_last
    cut[-1] = False  # the last attempt has no end
    agent = make_agent(
      shown=shown, **{"final_rows": 3, "reward.final_share": 1.0}
    )
    for index, part in enumerate(shown.values()):
      ends = np.flatnonzero(part.is_last)
      held = part.observation[np.concatenate([ends - i for i in range(3)])]
      drawn = [agent.batches.draw(0).expert.inputs[index] for _ in range(9)]
      self.assertTrue(all(fixtures.among(torch.cat(drawn), held)))
      self.assertLen(torch.cat(drawn).unique(dim=0), len(held))

  def test_rows_of_success_do_not_reach_into_the_attempt_before(self):
    shown = fixtures.demonstrations(attempt=2)
    for part in shown.values():
      part.is_last[1::4] = False  # every other attempt has no end
    agent = make_agent(
      shown=shown, **{"final_rows": 3, "reward.final_share": 1.0}
    )
    expert = agent.batches.draw(0).expert
    for inputs, part in zip(expert.inputs, shown.values(), strict=True):
      whole = part.observation[part.episode % 2 == 1]
      self.assertTrue(all(fixtures.among(inputs, whole)))

  def test_a_task_with_nothing_but_success_draws_from_it_throughout(self):
    agent = make_agent(**{"final_rows": 20, "reward.final_share": 0.5})
    self.assertLen(agent.batches.draw(0).expert.inputs[0], fixtures.B)

  def test_expert_share_puts_expert_rows_into_the_batch_and_decays(self):
    share = {"reward.expert_share": 0.25, "reward.expert_share_decay": 0.5}
    agent = make_agent(**share)
    shown = [part.observation for part in fixtures.demonstrations().values()]
    for updates, expected in ((0, 8), (1, 4), (9, 0)):
      batch = agent.batches.draw(updates).batch
      found = fixtures.among(batch.inputs, *shown)
      self.assertEqual(sum(found), expected)

  def test_a_discriminator_that_would_see_nothing_is_refused(self):
    blind = {"reward.input": "state", "reward.masked": f"0:{OBS}"}
    with self.assertRaisesRegex(ValueError, "hide all that it sees"):
      make_agent(**blind)

  def test_masked_floats_earn_nothing_at_either_scale(self):
    fields = {"reward.input": "state", "inputs.tanh_feature_scale": 0.1}
    agent = make_agent(**fields, **{"reward.masked": "1:3"})
    raw = torch.stack([torch.zeros(OBS), *torch.eye(OBS)[[2, 3]]])
    inputs = agent.learner.networks.intentions.standardiser(raw)
    rewards = agent.learner.reward.rewards(inputs, torch.zeros(3, A)).T
    torch.testing.assert_close(rewards[1], rewards[0])
    self.assertFalse(torch.equal(rewards[2], rewards[0]))
    with self.assertRaisesRegex(ValueError, "5:7; the observation has 6"):
      make_agent(**{"reward.masked": "5:7"})

  def test_critics_do_not_see_masked_floats_and_intentions_do(self):
    raw = torch.stack([torch.zeros(OBS), *torch.eye(OBS)[[2, 3]]])
    action = torch.zeros(3, A)
    mask = {"inputs.tanh_feature_scale": 0.1, "critic.masked": "1:3"}
    for change in {"layout": "separate"}, {"actor_trunk": "own"}:
      fields = {f"networks.{name}": value for name, value in change.items()}
      networks = make_agent(**fields, **mask).learner.networks
      inputs = networks.intentions.standardiser(raw)
      for critics in (networks.critics, networks.target_critics):
        plain, masked, seen = critics(inputs, action).unbind(-1)
        torch.testing.assert_close(masked, plain)
        self.assertGreater((seen - plain).abs().min(), 0)
      plain, masked, _ = networks.intentions(inputs)[0].unbind(1)
      self.assertGreater((masked - plain).abs().min(), 0)
    with self.assertRaisesRegex(ValueError, "5:7; the observation has 6"):
      make_agent(**fields, **mask | {"critic.masked": "5:7"})

  def test_critics_see_revealed_floats_only_after_those_updates(self):
    agent = make_agent(
      **{
        "networks.layout": "separate",
        "inputs.tanh_feature_scale": 0.1,
        "critic.masked": "3:4",
        "critic.revealed": "1:3",
        "critic.revealed_after": 2,
      }
    )
    networks = agent.learner.networks
    raw = torch.stack([torch.zeros(OBS), torch.eye(OBS)[2]])
    inputs = networks.intentions.standardiser(raw)
    for updates in range(4):
      for critics in (networks.critics, networks.target_critics):
        plain, revealed = critics(inputs, torch.zeros(2, A)).unbind(-1)
        if updates <= 2:  # when the third update begins, weights are 0
          torch.testing.assert_close(revealed, plain, rtol=0, atol=0)
        else:
          self.assertGreater((revealed - plain).abs().min(), 0)
      agent.update()


class DeterminismTest(parameterized.TestCase):
  def test_same_seed_same_numbers(self):
    first, second, other = (
      make_agent(seed=seed, **_PERIODS) for seed in (3, 3, 4)
    )
    actions = _live(first)
    np.testing.assert_array_equal(actions, _live(second))
    np.testing.assert_equal(first.metrics(), second.metrics())
    self.assertGreater(np.abs(actions - _live(other)).max(), 1e-3)

  def test_each_source_of_random_numbers_follows_from_the_seed(self):
    first, again, other = (
      make_agent(seed=seed).state_dict() for seed in (3, 3, 4)
    )
    for path in (
      ("acting",),
      ("sampling",),
      ("scheduler", "generator"),
      ("learner", "generator"),
      ("learner", "networks", "critics"),
    ):
      one, same, differs = (
        functools.reduce(operator.getitem, path, state)
        for state in (first, again, other)
      )
      np.testing.assert_equal(one, same)
      with self.assertRaises(AssertionError, msg=path):
        np.testing.assert_equal(one, differs)

  @parameterized.parameters(
    {},
    {"bfloat16": True},
    {"optimiser.weight_decay": 0.01, "inputs.standardise": True},
    {"pretraining.updates": 3, "reward.expert_share": 0.1},
    {"prior.weight": 1.0, "prior.decay": 0.9},
    {"reward.main_masked": "0:2"},
    {"critic.masked": "0:2"},
    {
      "networks.layout": "separate",
      "critic.revealed": "0:2",
      "critic.revealed_after": 3,
    },
    {"networks.layout": "separate", "critic.value_penalty": 10.0},
    {"threads": 2},
  )
  def test_resumed_agent_goes_on_bit_for_bit(self, **fields):
    fields |= {**_PERIODS, "networks.actor_trunk": "own"}
    agent = make_agent(seed=3, **fields)
    agent.prepare()
    _live(agent, episodes=2)
    resumed = make_agent(seed=8, **fields)
    resumed.load_state_dict(fixtures.reloaded(agent.state_dict()))
    resumed.prepare()
    np.testing.assert_array_equal(_live(agent, 2), _live(resumed, 2))
    np.testing.assert_equal(agent.metrics(), resumed.metrics())
    fixtures.assert_same_policy(agent, resumed)

  def test_state_is_a_copy(self):
    agent = make_agent()
    state = agent.state_dict()["learner"]["networks"]["intentions"]
    before = state["heads.output.bias"].copy()
    agent.update()
    np.testing.assert_array_equal(state["heads.output.bias"], before)
