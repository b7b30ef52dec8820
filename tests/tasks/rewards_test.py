"""Rewards, and the hold that makes a condition a success."""

import functools

from absl.testing import parameterized

import lfgp_dmc
from lfgp_dmc.task_names import ALL_TASKS
from tests.tasks import fixtures
from tests.tasks.fixtures import pose

_OPENS, _CLOSES = (0, 0, 0, -1.0), (0, 0, 0, 1.0)


class RewardTest(parameterized.TestCase):
  def start(self, **options):
    env = fixtures.environment("open_gripper", **options)
    env.reset_to(tcp=(0.0, 0.5, 0.2), blue=pose())
    return env

  def opened(self, env, action) -> bool:
    return bool(env.step(action).observation["success/open_gripper"])

  @parameterized.parameters("stack", "unstack_stack")
  def test_rewards_can_be_observed_and_sum_their_terms(self, main_task):
    env = lfgp_dmc.load(main_task, seed=0, reward="dense", show_rewards=True)
    self.assertIn(f"reward/{main_task}", env.observation_spec())
    env.reset()
    timestep = env.step([0.1, 0.2, -0.3, 1.0])
    rewards = {
      name: float(timestep.observation[f"reward/{name}"]) for name in ALL_TASKS
    }
    for name, reward in rewards.items():
      total = sum(env.task.reward_terms(name).values())
      self.assertAlmostEqual(reward, total)
    self.assertAlmostEqual(timestep.reward, rewards[main_task])
    # Green starts on blue in Unstack-Stack alone, and costs there.
    penalty = env.task.reward_terms("reach").get("off_tray", 0.0)
    self.assertEqual(penalty, -0.1 if main_task == "unstack_stack" else 0.0)

  def test_sparse_reward_is_the_condition(self):
    env = self.start()
    self.assertEqual(env.step(_OPENS).reward, 1.0)
    self.assertEqual(env.step(_CLOSES).reward, 0.0)

  def test_an_episode_begins_without_the_last_ones_action_or_success(self):
    env = self.start()
    self.assertTrue([self.opened(env, _OPENS) for _ in range(10)][-1])
    first = env.reset_to(tcp=(0.0, 0.5, 0.2), blue=pose()).observation
    self.assertFalse(first["condition/open_gripper"])
    self.assertFalse(first["success/open_gripper"])
    self.assertFalse(any(self.opened(env, _OPENS) for _ in range(9)))

  def test_success_needs_ten_checks_then_latches_until_cleared(self):
    env = self.start()
    opened = functools.partial(self.opened, env)
    self.assertFalse(any(opened(_OPENS) for _ in range(9)))
    self.assertFalse(opened(_CLOSES))  # breaks the hold
    self.assertEqual([opened(_OPENS) for _ in range(10)], [False] * 9 + [True])
    self.assertTrue(opened(_CLOSES))
    env.clear_success()
    self.assertFalse(opened(_OPENS))

  def test_a_success_check_falls_every_50_ms_at_5_hz(self):
    env = self.start(control_hz=5)
    flags = [self.opened(env, _OPENS) for _ in range(3)]
    self.assertEqual(flags, [False, False, True])
