"""The environment contract, on all nine tasks."""

import numpy as np
from absl.testing import absltest, parameterized
from dm_control import composer

import lfgp_dmc
from lfgp_dmc import tasks
from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import workspace as ws

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


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
    observation_spec = env.observation_spec()
    self.assertEqual(observation_spec.keys(), timestep.observation.keys())
    for name, part in observation_spec.items():
      part.validate(timestep.observation[name])
    flat = lfgp_dmc.flatten(timestep.observation)
    self.assertEqual(
      (flat.shape, flat.dtype), ((OBSERVATION_SIZE,), np.float32)
    )
    self.assertEqual(
      set(lfgp_dmc.successes(timestep.observation)), set(ALL_TASKS)
    )
    self.assertEqual(
      set(lfgp_dmc.conditions(timestep.observation)), set(ALL_TASKS)
    )
    timestep = env.step(np.zeros(4))
    self.assertTrue(timestep.mid())
    self.assertEqual(timestep.discount, 1.0)
    self.assertIn(timestep.reward, (0.0, 1.0))
    env.close()

  @parameterized.parameters(*ALL_TASKS)
  def test_starts_are_fair(self, task):
    env = lfgp_dmc.load(task, seed=1)
    for _ in range(15):
      observed = env.reset().observation
      holding = lfgp_dmc.conditions(observed)
      self.assertFalse(any(holding[name] for name in lfgp_dmc.MAIN_TASKS))
      self.assertFalse(any(lfgp_dmc.successes(observed).values()))
      blocks = observed["block_positions"].reshape(2, 3)
      tcp = observed["ee_position"]
      self.assertLessEqual(np.abs(tcp[:2] - ws.CENTRE_XY).max(), 0.076)
      self.assertBetween(tcp[2], 0.174, 0.271)
      np.testing.assert_allclose(observed["finger_positions"], 1.0, atol=0.01)
      self.assertLess(np.abs(observed["block_linear_velocities"]).max(), 0.01)
      stacked = abs(blocks[1, 2] - ws.STACKED_Z) < 1e-3
      self.assertEqual(stacked, task == "unstack_stack")
      if not stacked:
        gap = np.linalg.norm(blocks[0, :2] - blocks[1, :2])
        self.assertGreater(gap, 0.0399)


class EnvironmentTest(parameterized.TestCase):
  def test_an_episode_is_360_steps_then_a_truncation(self):
    env = lfgp_dmc.load("reach", seed=0)
    timestep, steps = env.reset(), 0
    while not timestep.last():
      timestep, steps = env.step(np.zeros(4)), steps + 1
    self.assertEqual(steps, 360)
    self.assertEqual(timestep.discount, 1.0)
    self.assertTrue(env.step(np.zeros(4)).first())

  @parameterized.parameters((20, 90), (10, 45), (5, 22))
  def test_control_rate_and_time_limit_set_the_length(self, rate, length):
    env = lfgp_dmc.load("reach", seed=0, control_hz=rate, time_limit=4.5)
    timestep, steps = env.reset(), 0
    while not timestep.last():
      timestep, steps = env.step(np.zeros(4)), steps + 1
    self.assertEqual(steps, length)

  def test_a_slower_control_rate_moves_as_far_in_a_second(self):
    ends = []
    for rate in (20, 5):
      env = lfgp_dmc.load("reach", seed=0, control_hz=rate)
      env.reset_to(
        tcp=(-0.1, 0.5, 0.25),
        blue=[0.1, 0.6, ws.FLAT_Z, *_UPRIGHT],
        green=[0.1, 0.4, ws.FLAT_Z, *_UPRIGHT],
      )
      for _ in range(rate):
        timestep = env.step([1.0, 0.0, 0.0, 0.0])
      ends.append(timestep.observation["ee_position"][0])
    self.assertAlmostEqual(ends[0], ends[1], places=3)

  def test_same_seed_and_actions_give_the_same_bits(self):
    actions = np.random.default_rng(0).uniform(-1, 1, (40, 4))

    def play(env):
      out = [lfgp_dmc.flatten(env.reset().observation)]
      out += [lfgp_dmc.flatten(env.step(a).observation) for a in actions]
      return np.array(out)

    first = lfgp_dmc.load("stack", seed=7)
    played = play(first)
    again = play(lfgp_dmc.load("stack", seed=7))
    np.testing.assert_array_equal(played, again)
    # A reseeded environment forgets what came before.
    play(first)
    first.reseed(7)
    np.testing.assert_array_equal(played, play(first))
    self.assertFalse(
      np.array_equal(played, play(lfgp_dmc.load("stack", seed=8)))
    )

  def test_reset_to_puts_everything_where_it_is_told(self):
    env = lfgp_dmc.load("stack", seed=0)
    turn = np.array([np.cos(0.3), 0.0, 0.0, np.sin(0.3)])
    observed = env.reset_to(
      tcp=(0.05, 0.45, 0.2),
      blue=[0.03, 0.52, 0.2, *turn],
      green=[-0.1, 0.6, ws.FLAT_Z, *_UPRIGHT],
      fingers=0.53,
    ).observation
    np.testing.assert_allclose(
      observed["ee_position"], [0.05, 0.45, 0.2], atol=1e-4
    )
    np.testing.assert_allclose(
      observed["block_positions"], [0.03, 0.52, 0.2, -0.1, 0.6, ws.FLAT_Z]
    )
    np.testing.assert_allclose(observed["block_rotations"][:4], turn, atol=1e-6)
    np.testing.assert_allclose(observed["finger_positions"], 0.53, atol=1e-6)

  def test_reset_to_samples_what_it_is_not_told(self):
    env = lfgp_dmc.load("stack", seed=0)
    blue = [0.0, 0.5, ws.FLAT_Z, *_UPRIGHT]
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
    env = lfgp_dmc.load("stack", seed=0)
    with self.assertRaisesRegex(ValueError, message):
      env.reset_to(**options)
    self.assertTrue(env.reset().first())

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

  def test_a_bad_action_is_refused_and_the_episode_goes_on(self):
    env = lfgp_dmc.load("stack", seed=0)
    env.reset()
    with self.assertRaisesRegex(ValueError, "NaN"):
      env.step([np.nan, 0, 0, 0])
    with self.assertRaisesRegex(ValueError, "shape"):
      env.step([0, 0, 0])
    self.assertTrue(env.step(np.zeros(4)).mid())

  def test_full_tray_reaches_beyond_the_published_starts(self):
    env = lfgp_dmc.load("stack", seed=0, spawn="full_tray")
    blocks = np.array(
      [
        env.reset().observation["block_positions"].reshape(2, 3)
        for _ in range(40)
      ]
    )
    away = np.abs(blocks[..., :2] - ws.CENTRE_XY).max(axis=-1)
    self.assertGreater(away.max(), 0.1)
    self.assertLess(away.max(), 0.131)

  def test_rewards_can_be_observed_and_sum_their_terms(self):
    env = lfgp_dmc.load("stack", seed=0, reward="dense")
    for name, value in env.task.observables.items():
      if name.startswith("reward/"):
        value.enabled = True
    env.reset()
    timestep = env.step([0.1, 0.2, -0.3, 1.0])
    for name in ALL_TASKS:
      total = sum(env.task.reward_terms(name).values())
      self.assertAlmostEqual(
        float(timestep.observation[f"reward/{name}"]), total
      )
    self.assertAlmostEqual(
      timestep.reward, float(timestep.observation["reward/stack"])
    )

  def test_sparse_reward_is_the_condition(self):
    env = lfgp_dmc.load("open_gripper", seed=0)
    blue = [0.0, 0.5, ws.FLAT_Z, *_UPRIGHT]
    env.reset_to(tcp=(0.0, 0.5, 0.2), blue=blue)
    self.assertEqual(env.step([0, 0, 0, -1.0]).reward, 1.0)
    self.assertEqual(env.step([0, 0, 0, 1.0]).reward, 0.0)

  def test_success_needs_ten_checks_then_latches_until_cleared(self):
    env = lfgp_dmc.load("open_gripper", seed=0)
    blue = [0.0, 0.5, ws.FLAT_Z, *_UPRIGHT]
    env.reset_to(tcp=(0.0, 0.5, 0.2), blue=blue)

    def opened(command) -> bool:
      observed = env.step([0, 0, 0, command]).observation
      return bool(observed["success/open_gripper"])

    self.assertFalse(any(opened(-1.0) for _ in range(9)))
    self.assertFalse(opened(1.0))  # breaks the hold
    self.assertEqual([opened(-1.0) for _ in range(10)], [False] * 9 + [True])
    self.assertTrue(opened(1.0))
    env.clear_success()
    self.assertFalse(opened(-1.0))

  def test_a_success_check_falls_every_50_ms_at_5_hz(self):
    env = lfgp_dmc.load("open_gripper", seed=0, control_hz=5)
    env.reset_to(tcp=(0.0, 0.5, 0.2), blue=[0.0, 0.5, ws.FLAT_Z, *_UPRIGHT])
    flags = [
      bool(env.step([0, 0, 0, -1.0]).observation["success/open_gripper"])
      for _ in range(3)
    ]
    self.assertEqual(flags, [False, False, True])

  def test_a_divergence_ends_the_episode_with_discount_0_and_is_counted(self):
    env = lfgp_dmc.load("stack", seed=0)
    env.reset()
    env.physics.data.qvel[0] = np.nan
    timestep = env.step(np.zeros(4))
    self.assertTrue(timestep.last())
    self.assertEqual(timestep.discount, 0.0)
    self.assertEqual(env.physics_failures, 1)
    self.assertTrue(env.reset().first())
    self.assertTrue(env.step(np.zeros(4)).mid())

  def test_wrist_reads_zero_unloaded_and_the_weight_of_a_block(self):
    env = lfgp_dmc.load("stack", seed=0)
    env.reset_to(
      tcp=(0.0, 0.5, ws.FLAT_Z),
      blue=[0.0, 0.5, ws.FLAT_Z, *_UPRIGHT],
      green=[0.1, 0.6, ws.FLAT_Z, *_UPRIGHT],
    )
    for _ in range(5):
      unloaded = env.step(np.zeros(4)).observation["force_torque"]
    np.testing.assert_allclose(unloaded, 0.0, atol=1e-3)
    for action in 12 * [[0, 0, 0, 1.0]] + 10 * [[0, 0, 1.0, 1.0]]:
      env.step(action)
    for _ in range(20):
      loaded = env.step([0, 0, 0, 1.0]).observation["force_torque"]
    force = np.linalg.norm(np.arctanh(loaded[:3])) * 100.0
    self.assertAlmostEqual(force, 0.1 * 9.81, delta=0.05)

  def test_zone_lights_up_while_its_block_is_in_it(self):
    env = lfgp_dmc.load("bring", seed=0)
    zone = env.task.world.zones["blue"]
    for xy, lit in (((0.075, 0.5), True), ((0.0, 0.5), False)):
      env.reset_to(
        blue=[*xy, ws.FLAT_Z, *_UPRIGHT],
        green=[-0.1, 0.6, ws.FLAT_Z, *_UPRIGHT],
        tcp=(0.0, 0.5, 0.28),
      )
      env.step(np.zeros(4))
      self.assertEqual(zone.lit, lit)


class LoadTest(absltest.TestCase):
  def test_facade_and_room_make_the_same_environment(self):
    facade = lfgp_dmc.load("bring", seed=3).reset().observation
    room = tasks.load("bring", seed=3).reset().observation
    np.testing.assert_array_equal(
      lfgp_dmc.flatten(facade), lfgp_dmc.flatten(room)
    )


if __name__ == "__main__":
  absltest.main()
