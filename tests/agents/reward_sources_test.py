"""Rewards from the replay (SAC-X) and from examples of success."""

import math

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents import rewards, synthetic
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp import LfgpConfig, build
from lfgp_dmc.agents.lfgp.batches import with_examples
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.types import Episode

TASKS = ("stack", "reach", "lift")
STORED = ("lift", "bring", "stack", "reach")  # in another order, and more
OBS, A, ROWS = 6, 2, 200


def _replay():
  generator = np.random.default_rng(7)
  stored = generator.standard_normal((ROWS, len(STORED))).astype(np.float32)
  rows = synthetic.transitions(ROWS, OBS, A)
  return synthetic.ArrayReplay(rows, stored, STORED)


def _build(replay=None, shown=None, **fields):
  settings = {
    "hidden_size": 16,
    "batch_size": 32,
    "discriminator_batch_size": 32,
    "random_steps": 0,
    "scheduler": "uniform",
    "xi": 5,
    "episode_steps": 20,
  }
  if shown is None:
    shown = synthetic.demonstrations(TASKS, 60, OBS, A, attempt=20)
  return build(
    LfgpConfig(**(settings | fields)),
    TASKS,
    shown,
    _replay() if replay is None else replay,
    0,
    "cpu",
    OBS,
    A,
  )


class StoredRewardsTest(absltest.TestCase):
  def test_batches_carry_each_tasks_own_reward(self):
    replay = _replay()
    agent = _build(replay, {}, reward_source="replay")
    batch = agent.batches.draw(0).batch
    by_row = {
      row.tobytes(): rewards
      for row, rewards in zip(
        replay._rows.observation, replay._rewards, strict=True
      )
    }
    for index, row in enumerate(batch.inputs.numpy()):
      stored = by_row[row.tobytes()]
      expected = [stored[STORED.index(task)] for task in TASKS]
      np.testing.assert_array_equal(batch.reward[:, index], expected)

  def test_there_is_no_discriminator_and_no_need_of_demonstrations(self):
    agent = _build(shown={}, reward_source="replay")
    agent.update()
    self.assertIsNone(agent.learner.networks.discriminator)
    metrics = agent.metrics()
    self.assertTrue(math.isnan(metrics["loss/discriminator"]))
    self.assertTrue(math.isfinite(metrics["loss/critic"]))
    self.assertTrue(math.isfinite(metrics["reward/lift"]))

  def test_rewards_are_scaled_and_bounded(self):
    agent = _build(
      shown={}, reward_source="replay", reward_clip=0.5, reward_scale=0.1
    )
    batch = agent.batches.draw(0).batch
    reward = agent.learner.rewards_of(batch)
    torch.testing.assert_close(reward, 0.1 * batch.reward.clamp(-0.5, 0.5))
    self.assertAlmostEqual(reward.abs().max().item(), 0.05, places=6)

  def test_scheduler_learns_from_the_stored_main_reward(self):
    agent = _build(
      shown={},
      reward_source="replay",
      scheduler="q_table",
      scheduler_phi=1.0,
      discount=0.5,
    )
    rows = synthetic.transitions(20, OBS, A, seed=5)
    stored = np.zeros((20, len(STORED)), np.float32)
    stored[:, STORED.index("stack")] = np.arange(20)
    agent.begin_episode()
    chosen = [TASKS.index(_acting(agent, row)) for row in rows.observation]
    agent.end_episode(Episode(rows.observation, rows.action, stored))
    expected = sum((15 + t) * 0.5**t for t in range(5))
    value = agent._scheduler.value(chosen[::5])
    self.assertAlmostEqual(value, expected, places=4)

  def test_a_replay_without_a_tasks_reward_is_refused(self):
    rows = synthetic.transitions(20, OBS, A)
    for stored, message in ((("lift",), "lift"), ((), "none")):
      replay = synthetic.ArrayReplay(rows, np.zeros((20, 1)), stored)
      with self.assertRaisesRegex(
        ValueError, f"no rewards of stack, reach.*keeps: {message}"
      ):
        _build(replay, {}, reward_source="replay")


class ExamplesTest(parameterized.TestCase):
  def test_reward_by_hand(self):
    owner = torch.tensor([-1, 0, 1, -1])
    expected = [[-1.0, 1, -1, -1], [-1, -1, 1, -1], [-1, -1, -1, -1]]
    torch.testing.assert_close(
      rewards.reward_from_examples(owner, 3), torch.tensor(expected)
    )

  def test_half_of_the_batch_are_final_states_split_over_tasks(self):
    shown = synthetic.demonstrations(TASKS, 60, OBS, A, attempt=20)
    agent = _build(
      shown=shown, reward_source="examples", batch_size=64, example_noise=0.0
    )
    draw = agent.batches.draw(0)
    self.assertIsNone(draw.discriminator_batch)
    owner = draw.batch.owner.tolist()
    # 32 examples: 10 a task, and 2 more for the main task.
    self.assertEqual(owner, [-1] * 32 + [0] * 12 + [1] * 10 + [2] * 10)
    for row, task in zip(draw.batch.inputs[32:], owner[32:], strict=True):
      part = shown[TASKS[task]]
      finals = part.next_observation[part.is_last]
      self.assertIn(row.numpy().tobytes(), {f.tobytes() for f in finals})
    torch.testing.assert_close(
      draw.batch.inputs[32:], draw.batch.next_inputs[32:]
    )

  def test_noise_is_in_the_tasks_own_deviations(self):
    shown = synthetic.demonstrations(TASKS, 60, OBS, A, attempt=20)
    pool = ExpertPool(shown, TASKS, Standardiser(OBS))
    generator = np.random.default_rng(0)
    batch = pool.sample_examples(generator, 30_000, noise=0.1)
    apart = batch.inputs - batch.next_inputs
    for index, task in enumerate(TASKS):
      expected = 0.1 * np.sqrt(2) * shown[task].next_observation.std(0)
      found = apart[batch.owner == index].numpy().std(0)
      np.testing.assert_allclose(found, expected, rtol=0.05)

  def test_an_example_gets_an_action_of_its_tasks_intention(self):
    agent = _build(reward_source="examples")
    learner, heads = agent.learner, agent.learner.networks.intentions.heads
    with torch.no_grad():  # task k always acts tanh(k)
      heads.output.weight.zero_()
      heads.output.bias.fill_(-50.0)
      for task in range(len(TASKS)):
        heads.output.bias[task, :, :A] = task
    before = agent.batches.draw(0).batch
    after = learner.intentions.with_fresh_actions(before)
    kept = before.owner < 0
    torch.testing.assert_close(after.action[kept], before.action[kept])
    expected = torch.tanh(before.owner[~kept].float())[:, None].expand(-1, A)
    torch.testing.assert_close(after.action[~kept], expected)

  def test_critics_learn_from_their_own_examples_intentions_from_none(self):
    """Other tasks' examples change neither loss of a task."""
    metrics = []
    for shift in (0.0, 100.0):
      agent = _build(  # with the trunk frozen, tasks share nothing
        reward_source="examples", freeze_updates=1, max_gradient_norm=1e9
      )
      draw = agent.batches.draw(0)
      others = (draw.batch.owner > 0)[:, None]
      batch = draw.batch._replace(
        inputs=draw.batch.inputs + shift * others,
        next_inputs=draw.batch.next_inputs + shift * others,
      )
      agent.learner.update(batch)
      networks = agent.learner.networks
      metrics.append(
        [
          networks.critics.heads.output.weight[[0, 3]].clone(),
          networks.intentions.heads.output.weight[0].clone(),
        ]
      )
    torch.testing.assert_close(*metrics)

  def test_values_of_examples_rise_above_the_rest(self):
    agent = _build(
      reward_source="examples",
      critic_learning_rate=3e-3,
      initial_temperature=0.01,
      polyak=0.05,
      reward_scale=0.1,
      value_penalty=10.0,
    )
    for _ in range(300):
      agent.update()
    metrics = agent.metrics()
    batch = agent.learner.intentions.with_fresh_actions(
      agent.batches.draw(0).batch
    )
    q = agent.learner.networks.critics(batch.inputs, batch.action)[0]
    for task in range(len(TASKS)):
      own = q[task][batch.owner == task].mean().item()
      rest = q[task][batch.owner < 0].mean().item()
      self.assertGreater(own, rest + 0.1)
      self.assertAlmostEqual(metrics[f"value_low/{TASKS[task]}"], -10, places=4)

  def test_examples_need_rows_of_success(self):
    shown = synthetic.demonstrations(TASKS, 10, OBS, A, attempt=50)
    with self.assertRaisesRegex(ValueError, r"is_last.*stack"):
      _build(shown=shown, reward_source="examples")

  def test_transitions_come_first(self):
    agent = _build(reward_source="examples")
    batch = agent.batches.draw(0).batch
    joined = with_examples(batch._replace(owner=None), batch)
    self.assertEqual(joined.owner[:32].tolist(), [-1] * 32)


class ConfigTest(parameterized.TestCase):
  @parameterized.parameters(
    ({"reward_source": "replay", "expert_share": 0.1}, "expert_share is 0.1"),
    ({"reward_source": "examples", "expert_share": 0.1}, "expert_share is 0.1"),
    ({"reward_source": "examples"}, "scheduler is 'q_table'"),
    (
      {
        "reward_source": "examples",
        "scheduler": "uniform",
        "example_share": 1.0,
      },
      "example_share is 1.0",
    ),
    ({"reward_source": "oracle"}, "discriminator, replay, examples"),
    (
      {"init_from": "runs/a", "bc_warm_start_updates": 10},
      "init_from is 'runs/a'; valid: nothing",
    ),
  )
  def test_what_does_not_go_together(self, fields, message):
    with self.assertRaisesRegex(ValueError, message):
      LfgpConfig(**fields)


def _acting(agent, row):
  agent.act(row)
  return agent.task


if __name__ == "__main__":
  absltest.main()
