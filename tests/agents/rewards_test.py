"""Rewards from the replay (SAC-X) and from examples of success."""

import math

import numpy as np
import torch
from absl.testing import absltest

from lfgp_dmc import toy
from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp.example_reward import with_examples
from lfgp_dmc.types import Episode
from tests.agents import fixtures
from tests.agents.fixtures import OBS, TASKS, A, make_agent

STORED = ("lift", "bring", "stack", "reach")  # in another order, and more
ROWS = 200
_EXAMPLES = {"reward.kind": "examples", "scheduler.kind": "uniform"}


def _rewards():
  generator = np.random.default_rng(7)
  return generator.standard_normal((ROWS, len(STORED))).astype(np.float32)


def _stored(**fields):
  rows = synthetic.transitions(ROWS, OBS, A)
  replay = synthetic.replay(rows, _rewards(), STORED)
  fields = {"reward.kind": "stored", "scheduler.xi": 5, **fields}
  return make_agent(shown={}, replay=replay, **fields)


class StoredRewardsTest(absltest.TestCase):
  def test_batches_carry_each_tasks_own_reward(self):
    batch = _stored().batches.draw(0).batch
    rows = synthetic.transitions(ROWS, OBS, A).observation
    expected = _rewards()[:, [STORED.index(task) for task in TASKS]]
    for row, reward in zip(batch.inputs, batch.stored_reward.T, strict=True):
      (index,) = np.flatnonzero((rows == row.numpy()).all(1))
      np.testing.assert_array_equal(reward, expected[index])

  def test_there_is_no_discriminator_and_no_need_of_demonstrations(self):
    agent = _stored()
    metrics = fixtures.train(agent, 1)
    self.assertIsNone(agent.learner.networks.discriminator)
    self.assertTrue(math.isnan(metrics["loss/discriminator"]))
    self.assertTrue(math.isfinite(metrics["loss/critic"]))
    self.assertTrue(math.isfinite(metrics["reward/lift"]))

  def test_rewards_are_scaled_and_bounded(self):
    agent = _stored(**{"reward.clip": 0.5, "reward.scale": 0.1})
    batch = agent.batches.draw(0).batch
    reward = agent.learner.reward.label(batch).reward
    expected = 0.1 * batch.stored_reward.clamp(-0.5, 0.5)
    torch.testing.assert_close(reward, expected)
    self.assertAlmostEqual(reward.abs().max().item(), 0.05, places=6)

  def test_scheduler_learns_from_the_stored_main_reward(self):
    as_stored = {"reward.clip": 5.0, "reward.scale": 0.1}  # not for it
    agent = _stored(
      **{"critic.discount": 0.5, "scheduler.phi": 1.0}, **as_stored
    )
    rows = synthetic.transitions(20, OBS, A, seed=5)
    stored = np.zeros((20, len(STORED)), np.float32)
    stored[:, STORED.index("stack")] = np.arange(20)
    chosen = fixtures.chosen(agent, rows.observation)
    agent.end_episode(Episode(rows.observation, rows.action, stored))
    expected = sum((15 + t) * 0.5**t for t in range(5))
    value = agent._scheduler.value(chosen[::5])
    self.assertAlmostEqual(value, expected, places=4)

  def test_a_replay_without_a_tasks_reward_is_refused(self):
    rows = synthetic.transitions(20, OBS, A)
    for stored, message in ((("lift",), "lift"), ((), "none")):
      rewards = np.zeros((20, len(stored)), np.float32)
      replay = synthetic.replay(rows, rewards, stored)
      with self.assertRaisesRegex(
        ValueError, f"no rewards of stack, reach.*keeps: {message}"
      ):
        make_agent(shown={}, replay=replay, **{"reward.kind": "stored"})

  def test_returns_rise(self):
    agent, replay = fixtures.make_toy_agent(
      1,
      2000,
      reward_tasks=toy.TASKS,
      **{
        "critic.discount": 0.9,
        "critic.learning_rate": 3e-3,
        "critic.polyak": 0.05,
        "intention.initial_temperature": 0.05,
        "intention.learning_rate": 3e-3,
        "reward.kind": "stored",
        "scheduler.xi": 10,
      },
    )
    before = _returns(agent)
    fixtures.train_on_toy(agent, replay, 500, self.create_tempdir().full_path)
    after = _returns(agent)
    for task in toy.TASKS:
      # Still: about 4; at the goal at once and staying there: about 18.
      self.assertGreater(after[task], 12.0)
      self.assertGreater(after[task], before[task] + 3.0)


def _returns(agent):
  rows = fixtures.evaluate_on_toy(agent, 5)
  return {
    task: np.mean([row.episode_return for row in rows if row.task == task])
    for task in toy.TASKS
  }


class ExamplesTest(absltest.TestCase):
  def test_half_of_the_batch_are_final_states_split_over_tasks(self):
    agent = make_agent(**_EXAMPLES, **{"batch_size": 64, "reward.noise": 0.0})
    draw = agent.batches.draw(0)
    self.assertIsNone(draw.policy)
    task = draw.batch.example_task.tolist()
    # 32 examples: 10 a task, and 2 more for the main task.
    self.assertEqual(task, [-1] * 32 + [0] * 12 + [1] * 10 + [2] * 10)
    shown = fixtures.demonstrations()
    for row, index in zip(draw.batch.inputs[32:], task[32:], strict=True):
      part = shown[TASKS[index]]
      finals = part.next_observation[part.is_last]
      self.assertTrue(*fixtures.among(row[None], finals))
    examples = draw.batch.inputs[32:]
    torch.testing.assert_close(draw.batch.next_inputs[32:], examples)

  def test_a_batch_without_examples_of_some_task_is_refused(self):
    with self.assertRaisesRegex(
      ValueError, "batch_size is 4; valid: more, .* are 2 examples of 3 tasks"
    ):
      make_agent(**_EXAMPLES, batch_size=4)

  def test_the_share_of_examples_is_the_configs(self):
    fields = {"batch_size": 64, "reward.share": 0.25}
    task = make_agent(**_EXAMPLES, **fields).batches.draw(0).batch.example_task
    self.assertEqual((task >= 0).tolist(), [False] * 48 + [True] * 16)

  def test_noise_is_in_the_tasks_own_stds(self):
    generator = np.random.default_rng(0)
    batch = with_examples(
      fixtures.batch(1), fixtures.pool(), generator, 30_000, noise=0.1
    )
    apart = batch.inputs - batch.next_inputs
    for index, part in enumerate(fixtures.demonstrations().values()):
      expected = 0.1 * np.sqrt(2) * part.next_observation.std(0)
      found = apart[batch.example_task == index].numpy().std(0)
      np.testing.assert_allclose(found, expected, rtol=0.05)

  def test_rewards_and_masks_by_hand(self):
    agent = make_agent(**_EXAMPLES, **{"batch_size": 8, "reward.scale": 0.5})
    labelled = agent.learner.reward.label(agent.batches.draw(0).batch)
    # 4 rows of the replay; 2 examples of the main task, 1 of each other.
    rest = [-0.5] * 4
    expected = [
      [*rest, 0.5, 0.5, -0.5, -0.5],
      [*rest, -0.5, -0.5, 0.5, -0.5],
      [*rest, -0.5, -0.5, -0.5, 0.5],
    ]
    torch.testing.assert_close(labelled.reward, torch.tensor(expected))
    own = torch.tensor([1, 1, 1, 1, 1, 1, 0, 0])
    torch.testing.assert_close(labelled.mask[0], own.float())
    self.assertEqual(labelled.policy_rows, 4)
    rows = synthetic.transitions(3, OBS, A)
    rewards = agent.learner.reward.main_rewards(Episode(*rows[:2]))
    self.assertEqual(rewards.tolist(), [-0.5] * 3)

  def test_an_example_gets_an_action_of_its_tasks_intention(self):
    agent = make_agent(**_EXAMPLES)
    heads = agent.learner.networks.intentions.heads
    with torch.no_grad():  # task k always acts tanh(k)
      heads.output.weight.zero_()
      heads.output.bias.fill_(-50.0)
      for task in range(len(TASKS)):
        heads.output.bias[task, :, :A] = task
    before = agent.batches.draw(0).batch
    after = agent.learner.reward.label(before)
    task = before.example_task
    kept = task < 0
    torch.testing.assert_close(after.action[kept], before.action[kept])
    expected = torch.tanh(task[~kept].float())[:, None].expand(-1, A)
    torch.testing.assert_close(after.action[~kept], expected)

  def test_critics_learn_from_their_own_examples_intentions_from_none(self):
    """Other tasks' examples change neither loss of a task."""
    found = []
    for shift in (0.0, 100.0):
      agent = make_agent(  # without a trunk, tasks share nothing
        **_EXAMPLES,
        **{
          "critic.value_penalty": 10.0,
          "networks.layout": "separate",
          "optimiser.max_gradient_norm": 1e9,
        },
      )
      draw = agent.batches.draw(0)
      others = (draw.batch.example_task > 0)[:, None]
      batch = draw.batch._replace(
        inputs=draw.batch.inputs + shift * others,
        next_inputs=draw.batch.next_inputs + shift * others,
      )
      agent.learner.update(draw._replace(batch=batch))
      networks = agent.learner.networks
      critics = networks.critics.heads.output.weight
      intentions = networks.intentions.heads.output.weight
      found.append([critics[[0, 3]].clone(), intentions[0].clone()])
    torch.testing.assert_close(*found)

  def test_values_of_examples_rise_above_the_rest(self):
    agent = make_agent(
      **_EXAMPLES,
      **{
        "critic.learning_rate": 3e-3,
        "critic.polyak": 0.05,
        "critic.value_penalty": 10.0,
        "intention.initial_temperature": 0.01,
        "reward.scale": 0.1,
      },
    )
    metrics = fixtures.train(agent, 300)
    batch = agent.batches.draw(0).batch
    action = agent.learner.reward.label(batch).action
    q = agent.learner.networks.critics(batch.inputs, action)[0]
    for task in range(len(TASKS)):
      own = q[task][batch.example_task == task].mean().item()
      rest = q[task][batch.example_task < 0].mean().item()
      self.assertGreater(own, rest + 0.1)
      self.assertAlmostEqual(metrics[f"value_low/{TASKS[task]}"], -10, places=4)
      # The examples' own value bounds the rest; 10 is theirs alone.
      self.assertLess(metrics[f"value_high/{TASKS[task]}"], 5)

  def test_need_rows_of_success(self):
    shown = fixtures.demonstrations(pairs=10, attempt=50)
    for fields in (_EXAMPLES, {"reward.final_share": 0.5}):
      with self.assertRaisesRegex(ValueError, r"is_last.*stack"):
        make_agent(shown=shown, **fields)
