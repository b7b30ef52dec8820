"""Scripted experts succeed, from the observation alone, and look right."""

import numpy as np
from absl.testing import parameterized

from lfgp_dmc import flatten, seeding
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import POLICIES, ScriptedExpert
from lfgp_dmc.tasks.experts.view import look
from tests.tasks import fixtures
from tests.tasks.fixtures import environment, pose


def _run(env, task, timestep, seed=0):
  """Plays until success; returns (succeeded, actions)."""
  expert = ScriptedExpert()
  expert.begin(task, seed)
  actions = []
  for _ in range(360):
    actions.append(expert.act(flatten(timestep.observation)))
    timestep = env.step(actions[-1])
    if timestep.observation[f"success/{task}"]:
      return True, np.array(actions)
  return False, np.array(actions)


class ExpertTest(parameterized.TestCase):
  @parameterized.parameters(*ALL_TASKS)
  def test_succeeds_within_the_ranges_required_of_its_data(self, task):
    env, every = environment(task), []
    for i in range(3):
      env.reseed(seeding.derive(3, "test", i))
      success, actions = _run(env, task, env.reset(), i)
      self.assertTrue(success, f"reset {i}")
      every.append(actions)
    actions = np.concatenate(every)
    self.assertEqual(actions.dtype, np.float32)
    size = np.abs(actions)
    self.assertLessEqual(size.max(), 1.0)
    self.assertGreaterEqual(size[:, 3].min(), 0.3)
    self.assertBetween(size.mean(), 0.2, 0.9)
    self.assertLess((size > 0.95).mean(), 0.4)
    grips = np.unique(actions[:, 3])
    self.assertGreater(len(grips), 0.9 * len(actions))  # continuous

  @parameterized.product(task=("reach", "stack", "bring"), control_hz=(5, 10))
  def test_succeeds_at_other_rates_in_as_much_time(self, task, control_hz):
    env = environment(task, control_hz=control_hz)
    expert = ScriptedExpert(control_hz=control_hz)
    for i in range(2):
      env.reseed(seeding.derive(3, "test", i))
      expert.begin(task, i)
      timestep = env.reset()
      for _ in range(10 * control_hz):
        timestep = env.step(expert.act(flatten(timestep.observation)))
      self.assertTrue(timestep.observation[f"success/{task}"], f"reset {i}")

  @parameterized.parameters(*ALL_TASKS)
  def test_the_observation_alone_decides(self, task):
    env = environment(task)
    env.reseed(11)
    timestep = env.reset()
    whole = ScriptedExpert(noise=0.0)
    whole.begin(task, 0)
    for step in range(120):
      observation = flatten(timestep.observation)
      action = whole.act(observation)
      fresh = ScriptedExpert(noise=0.0)
      fresh.begin(task, step + 1)
      np.testing.assert_array_equal(fresh.act(observation)[:3], action[:3])
      timestep = env.step(action)

  def test_the_seed_decides_the_noise(self):
    observation = flatten(environment("reach").reset().observation)
    actions = []
    for seed in (1, 1, 2):
      expert = ScriptedExpert()
      expert.begin("reach", seed)
      actions.append(expert.act(observation))
    np.testing.assert_array_equal(actions[0], actions[1])
    self.assertFalse((actions[0] == actions[2]).any())

  def test_a_slower_step_covers_what_four_would(self):
    # 6 mm above where it wants to be: 40 % of the way in 50 ms, 87 % in 200.
    start = {"tcp": (0.0, 0.5, 0.154), "blue": pose(), "green": pose(-0.1)}
    seen = flatten(environment("reach").reset_to(**start).observation)
    moves = []
    for rate in (20, 5):
      expert = ScriptedExpert(noise=0.0, control_hz=rate)
      expert.begin("reach", 0)
      moves.append(expert.act(seen)[2] * ws.SET_POINT_SPEED / rate)
    np.testing.assert_allclose(
      moves, [-0.4 * 0.006, -(1 - 0.6**4) * 0.006], rtol=0.05
    )

  def test_the_noise_is_a_quarter_of_its_own_at_rest(self):
    start = {"tcp": (0.0, 0.5, 0.2), "blue": pose(), "green": pose(-0.1)}
    seen = flatten(environment("reach").reset_to(**start).observation)
    for noise in (0.1, 0.02):
      expert = ScriptedExpert(noise=noise)
      expert.begin("open_gripper", 0)  # whose noise is five times the usual
      moves = np.array([expert.act(seen)[:3] for _ in range(300)])
      self.assertAlmostEqual(moves.std() / (noise * 5 / 4), 1, delta=0.1)

  def test_unknown_task_and_noise_list_the_valid_ones(self):
    with self.assertRaisesRegex(ValueError, "'fly'; valid tasks: stack, "):
      ScriptedExpert().begin("fly", 0)
    with self.assertRaisesRegex(ValueError, "valid is 0 or more"):
      ScriptedExpert(noise=-0.1)
    self.assertEqual(tuple(POLICIES), ALL_TASKS)


_PLAY_STATES = {
  "blue in its slot": {"tcp": (0.075, 0.5, 0.17), "blue": pose(*ws.BLUE_SLOT)},
  "green on blue": {
    "blue": pose(-0.02, 0.46),
    "green": pose(-0.02, 0.46, ws.STACKED_Z),
  },
  "blue on green": {
    "blue": pose(0.03, 0.55, ws.STACKED_Z),
    "green": pose(0.03, 0.55),
  },
  "blocks touch along y": {
    "tcp": (0.0, 0.5, 0.2),
    "blue": pose(0.0, 0.48),
    "green": pose(0.005, 0.5202),
  },
}


class PlayStatesTest(parameterized.TestCase):
  """States that other tasks leave behind, all in Stack's environment."""

  @parameterized.parameters(
    ("blue in its slot", "reach lift stack move_object"),
    ("blue in its slot", "open_gripper close_gripper"),
    ("green on blue", "reach lift move_object stack"),
    ("blue on green", "reach lift bring move_object"),
    ("blocks touch along y", "reach lift"),
  )
  def test_succeeds_from(self, state, tasks):
    env, start = environment(), {"tcp": (0.0, 0.5, 0.26), **_PLAY_STATES[state]}
    for task in tasks.split():
      self.assertTrue(_run(env, task, env.reset_to(**start))[0], task)

  @parameterized.parameters("reach", "open_gripper", "stack", "bring")
  def test_succeeds_with_green_in_hand(self, task):
    env = environment()
    env.reset_to(tcp=(0.0, 0.5, 0.151), green=pose(), blue=pose(-0.1))
    fixtures.repeat(env, (0, 0, 0, 1), 12)
    timestep = fixtures.repeat(env, (0, 0, 0.5, 1), 10)
    self.assertGreater(look(flatten(timestep.observation)).green.z, 0.17)
    env.clear_success()
    self.assertTrue(_run(env, task, timestep)[0])
