"""Schedulers on toy problems whose optimum is known."""

import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc import task_names
from lfgp_dmc.agents import schedulers
from lfgp_dmc.agents.schedulers.config import QTableConfig
from tests.agents import fixtures

TASKS = task_names.task_set("stack")
STACK, LIFT = TASKS.index("stack"), TASKS.index("lift")
STATES, STEPS, XI = 5, 16, 4


class SequenceTest(absltest.TestCase):
  """A period pays 10 if it stacks what the one before it has lifted."""

  def test_q_table_finds_the_best_sequence(self):
    table = schedulers.make_scheduler(
      QTableConfig(temperature=20.0), TASKS, np.random.default_rng(0)
    )
    totals = []
    for _ in range(2500):
      table.begin_episode()
      chosen = [table.next_task() for _ in range(4)]
      pairs = zip([-1, *chosen], chosen, strict=False)
      rewards = [10.0 * (pair == (LIFT, STACK)) for pair in pairs]
      table.end_episode(np.cumsum(rewards[::-1])[::-1].tolist())
      totals.append(sum(rewards))
    self.assertLess(np.mean(totals[:100]), 3.0)
    # Lift, stack, lift, stack.
    self.assertGreater(np.mean(totals[-100:]), 19.0)


class GuidedExplorationTest(parameterized.TestCase):
  """A corridor, of which only the far end pays the main task.

  The main intention is greedy with respect to its values, and goes back where
  they are equal: alone it never gets to the end. Lifting goes ahead.
  """

  @parameterized.parameters("q_table", "conditional_weighted", "uniform")
  def test_the_main_task_reaches_its_optimum(self, name):
    value = self._learn(name)
    np.testing.assert_allclose(value.max(1), _optimum(), rtol=0.02)
    self.assertTrue((value[:, 1] > value[:, 0]).all())

  def test_without_guidance_it_never_does(self):
    self.assertEqual(self._learn("main_only").max(), 0.0)

  def _learn(self, name):
    generator = np.random.default_rng(1)
    fields = {"scheduler.kind": name}
    if name == "q_table":  # the scale of temperatures is the returns'
      fields["scheduler.temperature"] = 20.0
    scheduler = schedulers.make_scheduler(
      fixtures.config(**fields).scheduler, TASKS, generator
    )
    value = np.zeros((STATES, 2))
    for _ in range(300):
      scheduler.begin_episode()
      state, rewards = 0, []
      for step in range(STEPS):
        if step % XI == 0:
          task = scheduler.next_task()
        ahead = value[state, 1] > value[state, 0]
        action = int(generator.integers(2))
        if task in (STACK, LIFT):
          action = int(ahead) if task == STACK else 1
        after = _move(state, action)
        reward = float(after == STATES - 1)
        target = reward + 0.9 * value[after].max()
        value[state, action] += 0.5 * (target - value[state, action])
        rewards.append(reward)
        state = after
      returns = schedulers.period_returns(np.array(rewards), XI, 0.99)
      scheduler.end_episode(returns.tolist())
    return value


def _move(state, action):
  return min(state + 1, STATES - 1) if action else max(state - 1, 0)


def _optimum():
  """Going ahead and staying there: gamma^n / (1 - gamma), n steps before."""
  left = np.maximum(STATES - 2 - np.arange(STATES), 0)
  return 0.9**left / 0.1
