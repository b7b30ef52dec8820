"""The environment contract, on all nine tasks."""

import functools

import numpy as np
from absl.testing import parameterized
from dm_control import composer

import lfgp_dmc
from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import workspace as ws
from tests.tasks import fixtures
from tests.tasks.fixtures import KEEP, pose

_OPENS, _CLOSES = (0, 0, 0, -1.0), (0, 0, 0, 1.0)


class AllTasksTest(parameterized.TestCase):
  @parameterized.parameters(*ALL_TASKS)
  def test_contract(self, task):
    env = lfgp_dmc.load(task, seed=0)
    self.assertIsInstance(env, composer.Environment)
    spec = env.action_spec()
    self.assertEqual(spec.shape, (4,))
    np.testing.assert_array_equal(spec.minimum, -1.0)
    np.testing.assert_array_equal(spec.maximum, 1.0)
    timestep = env.reset()
    self.assertTrue(timestep.first())
    observed, expected = timestep.observation, env.observation_spec()
    self.assertEqual(expected.keys(), observed.keys())
    for name, part in expected.items():
      part.validate(observed[name])
    flat = lfgp_dmc.flatten(observed)
    self.assertEqual(flat.shape, (OBSERVATION_SIZE,))
    self.assertEqual(flat.dtype, np.float32)
    self.assertEqual(set(lfgp_dmc.successes(observed)), set(ALL_TASKS))
    self.assertEqual(set(lfgp_dmc.conditions(observed)), set(ALL_TASKS))
    timestep = env.step(KEEP)
    self.assertTrue(timestep.mid())
    self.assertEqual(timestep.discount, 1.0)
    self.assertIn(timestep.reward, (0.0, 1.0))
    env.close()

  @parameterized.parameters(*ALL_TASKS)
  def test_starts_are_fair(self, task):
    env = fixtures.environment(task)
    env.reseed(1)
    for _ in range(15):
      observed = env.reset().observation
      holding = lfgp_dmc.conditions(observed)
      self.assertFalse(any(holding[name] for name in lfgp_dmc.MAIN_TASKS))
      self.assertFalse(any(lfgp_dmc.successes(observed).values()))
      blue, green = observed["block_positions"].reshape(2, 3)
      tcp = observed["ee_position"]
      self.assertLessEqual(np.abs(tcp[:2] - ws.CENTRE_XY).max(), 0.076)
      self.assertBetween(tcp[2], 0.174, 0.271)
      np.testing.assert_allclose(observed["finger_positions"], 1.0, atol=0.01)
      self.assertLess(np.abs(observed["block_linear_velocities"]).max(), 0.01)
      stacked = abs(green[2] - ws.STACKED_Z) < 1e-3
      self.assertEqual(stacked, task == "unstack_stack")
      if not stacked:
        self.assertGreater(np.linalg.norm(blue[:2] - green[:2]), 0.0399)


class EpisodeTest(parameterized.TestCase):
  @parameterized.parameters(
    ({}, 360),
    ({"time_limit": 4.5}, 90),
    ({"time_limit": 4.5, "control_hz": 10}, 45),
    ({"time_limit": 4.5, "control_hz": 5}, 22),
  )
  def test_options_set_the_length_to_a_truncation(self, options, length):
    env = lfgp_dmc.load("reach", seed=0, **options)
    timestep, steps = env.reset(), 0
    while not timestep.last():
      timestep, steps = env.step(KEEP), steps + 1
    self.assertEqual(steps, length)
    self.assertEqual(timestep.discount, 1.0)
    self.assertTrue(env.step(KEEP).first())

  def test_a_slower_control_rate_moves_as_far_in_a_second(self):
    ends = []
    for rate in (20, 5):
      env = fixtures.environment("reach", control_hz=rate)
      env.reset_to((-0.1, 0.5, 0.25), pose(0.1, 0.6), pose(0.1, 0.4))
      timestep = fixtures.repeat(env, [1.0, 0.0, 0.0, 0.0], rate)
      ends.append(timestep.observation["ee_position"][0])
    self.assertAlmostEqual(ends[0], ends[1], places=3)

  def test_same_seed_and_actions_give_the_same_bits(self):
    actions = np.random.default_rng(0).uniform(-1, 1, (40, 4))

    def play(env):
      out = [lfgp_dmc.flatten(env.reset().observation)]
      out += [lfgp_dmc.flatten(env.step(a).observation) for a in actions]
      return np.array(out)

    first, second = (lfgp_dmc.load("stack", seed=7) for _ in range(2))
    played = play(first)
    np.testing.assert_array_equal(played, play(second))
    # A reseeded environment forgets what came before.
    play(first)
    first.reseed(7)
    np.testing.assert_array_equal(played, play(first))
    first.reseed(8)
    self.assertFalse(np.array_equal(played, play(first)))

  def test_a_bad_action_is_refused_and_the_episode_goes_on(self):
    env = fixtures.fresh()
    env.reset()
    with self.assertRaisesRegex(ValueError, "NaN"):
      env.step([np.nan, 0, 0, 0])
    with self.assertRaisesRegex(ValueError, "shape"):
      env.step([0, 0, 0])
    self.assertTrue(env.step(KEEP).mid())

  def test_a_divergence_ends_the_episode_with_discount_0_and_is_counted(self):
    env = lfgp_dmc.load("stack", seed=0)
    env.reset()
    env.physics.data.qvel[0] = np.nan
    timestep = env.step(KEEP)
    self.assertTrue(timestep.last())
    self.assertEqual(timestep.discount, 0.0)
    self.assertEqual(env.physics_failures, 1)
    self.assertTrue(env.reset().first())
    self.assertTrue(env.step(KEEP).mid())

  def test_zone_lights_up_while_its_block_is_in_it(self):
    env = fixtures.environment("bring")
    zone = env.task.world.zones["blue"]
    for x, is_lit in ((0.075, True), (0.0, False)):
      env.reset_to((0.0, 0.5, 0.28), pose(x), pose(-0.1, 0.6))
      env.step(KEEP)
      self.assertEqual(zone.is_lit, is_lit)


class StartTest(parameterized.TestCase):
  def test_reset_to_puts_everything_at_the_requested_place(self):
    env = fixtures.environment()
    turn = np.array([np.cos(0.3), 0.0, 0.0, np.sin(0.3)])
    observed = env.reset_to(
      tcp=(0.05, 0.45, 0.2),
      blue=pose(0.03, 0.52, 0.2, turn),
      green=pose(-0.1, 0.6),
      fingers=0.53,
    ).observation
    for name, expected, tolerance in (
      ("ee_position", [0.05, 0.45, 0.2], 1e-4),
      ("block_positions", [0.03, 0.52, 0.2, -0.1, 0.6, ws.FLAT_Z], 1e-7),
      ("block_rotations", [*turn, *fixtures.UPRIGHT], 1e-6),
      ("finger_positions", [0.53] * 6, 1e-6),
    ):
      np.testing.assert_allclose(observed[name], expected, atol=tolerance)

  def test_reset_to_samples_what_is_not_requested(self):
    env, blue = fixtures.fresh(), pose()
    greens = [
      env.reset_to(blue=blue).observation["block_positions"][3:]
      for _ in range(4)
    ]
    self.assertGreater(np.ptp(greens, axis=0)[0], 0.01)
    for green in greens:
      self.assertGreater(np.linalg.norm(green[:2] - blue[:2]), 0.0399)

  @parameterized.parameters(
    ({"tcp": (0.0, 0.5)}, "tcp has shape"),
    ({"blue": (0.0, 0.5, 0.2)}, "blue has shape"),
    ({"green": (np.nan,) * 7}, "green=.*not finite"),
    ({"fingers": 1.5}, "fingers=1.5; valid is 0"),
    ({"tcp": (3.0, 0.5, 0.2)}, "cannot reach"),
  )
  def test_reset_to_names_what_is_wrong(self, options, message):
    env = fixtures.environment()
    with self.assertRaisesRegex(ValueError, message):
      env.reset_to(**options)
    self.assertTrue(env.reset().first())

  def test_full_tray_reaches_beyond_the_published_starts(self):
    env = fixtures.fresh(spawn="full_tray")
    blocks = np.array(
      [env.reset().observation["block_positions"] for _ in range(40)]
    )
    away = np.abs(blocks.reshape(-1, 3)[:, :2] - ws.CENTRE_XY).max(axis=-1)
    self.assertGreater(away.max(), 0.1)
    self.assertLess(away.max(), 0.131)

  @parameterized.parameters(
    ("juggle", {}, "juggle.*stack, unstack_stack"),
    ("stack", {"reward": "shaped"}, "sparse, dense"),
    ("stack", {"observations": "pixels"}, "features, vision"),
    ("stack", {"spawn": "table"}, "published, full_tray"),
    ("stack", {"control_hz": 7}, "20, 10, 5"),
    ("stack", {"time_limit": 0.0}, "time_limit"),
    ("stack", {"colour": 1}, "unknown option colour; valid: reward, obs"),
  )
  def test_unknown_names_list_the_valid_ones(self, task, options, message):
    with self.assertRaisesRegex(ValueError, message):
      lfgp_dmc.load(task, **options)


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
