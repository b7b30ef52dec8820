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
