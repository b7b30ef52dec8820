"""SAC-X on the toy world: it earns more than at its start."""

import numpy as np
import torch
from absl.testing import absltest

from lfgp_dmc import toy
from tests.agents import fixtures


class SacxTest(absltest.TestCase):
  def test_return_rises(self):
    torch.set_num_threads(1)
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


if __name__ == "__main__":
  absltest.main()
