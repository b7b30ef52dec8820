"""The main task's discriminator can be a network of its own."""

import numpy as np
import torch
from absl.testing import absltest

from tests.agents import fixtures
from tests.agents.fixtures import OBS, A

TASKS = ("main", "open_gripper", "reach")
MASKED = {"reward.main_masked": "0:2", "reward.input": "state"}


def _agent(tasks=TASKS, **fields):
  return fixtures.make_agent(tasks, **{**MASKED, **fields})


class MainDiscriminatorTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    torch.set_num_threads(1)

  def test_it_alone_has_its_own_floats_masked(self):
    learner = _agent(**{"reward.masked": "3:4"}).learner
    action = torch.zeros(OBS + 1, A)
    changed = torch.cat([torch.zeros(1, OBS), torch.eye(OBS)])
    rewards = learner.reward.rewards(changed, action)
    differs = (rewards[:, 1:] - rewards[:, :1]).abs() > 1e-6
    main = [False, False, True, True, True, True]
    others = [True, True, True, False, True, True]
    self.assertEqual(differs.tolist(), [main, others, others])

  def test_a_task_alone_has_one_with_them_masked_too(self):
    agent = _agent(TASKS[:1])
    agent.update()
    self.assertTrue(np.isfinite(agent.metrics()["loss/discriminator"]))
    rewards = agent.learner.reward.rewards(torch.eye(OBS), torch.zeros(OBS, A))
    self.assertEqual(rewards.shape, (1, OBS))
    self.assertAlmostEqual(rewards[0, 0].item(), rewards[0, 1].item(), places=6)
    self.assertNotAlmostEqual(rewards[0, 0].item(), rewards[0, 2].item())

  def test_each_learns_from_its_own_tasks_pairs(self):
    agent = _agent(**{"reward.learning_rate": 3e-3})
    for _ in range(300):
      agent.update()
    agent.metrics()
    for _ in range(20):
      agent.update()
    metrics = agent.metrics()
    for task in TASKS:
      self.assertGreater(metrics[f"accuracy_expert/{task}"], 0.9)
      self.assertGreater(metrics[f"accuracy_policy/{task}"], 0.7)

  def test_metrics_are_means_over_tasks(self):
    agent = _agent()
    draw = agent.batches.draw(0)
    parts = agent.learner.reward._parts
    joined = agent.learner.reward._joined(
      [
        {"loss": torch.tensor(1.0), "reward": torch.tensor([5.0])},
        {"loss": torch.tensor(4.0), "reward": torch.tensor([6.0, 7.0])},
      ]
    )
    self.assertLen(parts, 2)
    self.assertEqual(joined["loss"].item(), 3.0)
    self.assertEqual(joined["reward"].tolist(), [5.0, 6.0, 7.0])
    metrics = agent.learner.update(draw)
    self.assertEqual(metrics["accuracy_policy"].shape, (3,))

  def test_a_checkpoint_brings_both_back(self):
    agent, other = _agent(), _agent()
    for _ in range(3):
      agent.update()
    other.load_state_dict(agent.state_dict())
    for _ in range(2):
      agent.update()
      other.update()
    rows = torch.ones(2, OBS), torch.ones(2, A)
    np.testing.assert_array_equal(
      agent.learner.reward.rewards(*rows), other.learner.reward.rewards(*rows)
    )

  def test_transfer_carries_the_other_tasks_over(self):
    for fields in ({}, {"reward.main_masked": ""}):
      source = _agent(("old", "reach", "open_gripper"), **fields)
      agent = _agent()
      own = agent.learner.networks
      kept = own.main_discriminator.output.weight.clone()
      state = source.learner.state_dict()["networks"]
      agent.carry_over(state, source.tasks)
      index = list(source.tasks).index("reach") - bool(not fields)
      np.testing.assert_array_equal(
        own.discriminator.output.weight[1].detach(),
        state["discriminator"]["output.weight"][index],
      )
      self.assertTrue(torch.equal(own.main_discriminator.output.weight, kept))

  def test_floats_that_are_not_there_are_refused(self):
    with self.assertRaisesRegex(ValueError, "5:9; the observation has 6"):
      _agent(**{"reward.main_masked": "5:9"})


if __name__ == "__main__":
  absltest.main()
