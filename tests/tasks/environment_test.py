"""The environment contract, on all nine tasks."""

import copy
import pickle

import numpy as np
from absl.testing import parameterized
from dm_control import composer

import lfgp_dmc
from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.goals import GOALS, starts
from tests.tasks import fixtures
from tests.tasks.fixtures import KEEP, pose


class AllTasksTest(parameterized.TestCase):
  @parameterized.parameters(*ALL_TASKS)
  def test_contract(self, task):
    env = lfgp_dmc.load(task, seed=0)
    self.assertIsInstance(env, composer.Environment)
    spec = env.action_spec()
    self.assertEqual(spec.shape, (4,))
    np.testing.assert_array_equal(spec.minimum, [-1.0] * 4)
    self.assertEqual(spec.minimum.shape, (4,))
    np.testing.assert_array_equal(spec.maximum, [1.0] * 4)
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
      self.assertEqual(stacked, GOALS[task].start is starts.GREEN_ON_BLUE)
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

  def test_without_a_time_limit_no_step_ends_the_episode(self):
    env = lfgp_dmc.load("reach", seed=0, time_limit=float("inf"), control_hz=5)
    env.reset()
    self.assertTrue(fixtures.repeat(env, KEEP, 100).mid())

  def test_hooks_are_called_once_a_control_step_or_refused(self):
    env, calls = lfgp_dmc.load("reach", seed=0), []
    env.add_extra_hook("after_step", lambda *_: calls.append(1))
    env.reset()
    fixtures.repeat(env, KEEP, 2)
    self.assertLen(calls, 2)
    with self.assertRaisesRegex(ValueError, "before_substep"):
      env.add_extra_hook("before_substep", lambda *_: None)

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

  @parameterized.parameters(
    copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))
  )
  def test_a_copy_goes_on_as_the_original_does(self, copied):
    env = lfgp_dmc.load("lift", 3, time_limit=0.1, reward="dense")
    env.reset()
    other = copied(env)
    self.assertTrue(other.needs_reset)
    for one in (env, other):
      self.assertTrue(one.reset().first())
      self.assertFalse(one.step(KEEP).last())
    last, same = env.step(KEEP), other.step(KEEP)
    self.assertTrue(last.last() and same.last())
    self.assertEqual(last.reward, same.reward)

  def test_a_bad_action_is_refused_and_the_episode_goes_on(self):
    env = fixtures.fresh()
    env.reset()
    with self.assertRaisesRegex(ValueError, "not finite"):
      env.step([np.nan, 0, 0, 0])
    with self.assertRaisesRegex(ValueError, "shape"):
      env.step([0, 0, 0])
    self.assertTrue(env.step(KEEP).mid())

  def test_a_divergence_ends_the_episode_with_discount_0_and_is_counted(self):
    env = lfgp_dmc.load("reach", seed=0, reward="dense")
    env.reset()
    env.physics.data.qvel[0] = np.nan
    timestep = env.step(KEEP)
    self.assertTrue(timestep.last())
    self.assertEqual((timestep.discount, timestep.reward), (0.0, 0.0))
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

  @parameterized.parameters(0.0, 0.4)
  def test_requested_fingers_stay_until_the_first_command(self, opening):
    env = fixtures.environment()
    env.reset_to((0.0, 0.5, 0.25), pose(-0.1), pose(0.1), fingers=opening)
    for action in (KEEP, [1.0, 0.0, 0.0, 0.0]):
      seen = fixtures.repeat(env, action, 5).observation["finger_positions"]
      np.testing.assert_allclose(seen[:2], opening, atol=0.02)

  def test_reset_to_samples_what_is_not_requested(self):
    env, blue = fixtures.fresh(), pose()
    greens = [
      env.reset_to(blue=blue).observation["block_positions"][3:]
      for _ in range(4)
    ]
    self.assertGreater(np.ptp(greens, axis=0)[0], 0.01)
    for green in greens:
      self.assertGreater(np.linalg.norm(green[:2] - blue[:2]), 0.0399)

  @parameterized.parameters({}, {"fingers": 0.5}, {"tcp": (0.0, 0.5, 0.2)})
  def test_what_reset_to_samples_is_at_rest_and_free_of_the_robot(
    self, **given
  ):
    env = fixtures.fresh("unstack_stack")
    for _ in range(20):  # one in ten would be touched, one in three by this tcp
      observed = env.reset_to(**given).observation
      self.assertFalse(any(env.task.world.reader.robot_touches(env.physics)))
      self.assertLess(np.abs(observed["block_linear_velocities"]).max(), 0.01)
      if "tcp" in given:
        np.testing.assert_allclose(
          observed["ee_position"], given["tcp"], atol=1e-3
        )

  def test_a_requested_block_may_lie_in_the_hand(self):
    env, held = fixtures.fresh(), pose(z=0.2)
    observed = env.reset_to(tcp=held[:3], blue=held, fingers=0.5).observation
    self.assertEqual(
      env.task.world.reader.robot_touches(env.physics), (True, False)
    )
    np.testing.assert_allclose(observed["block_positions"][:3], held[:3])

  def test_a_hand_where_the_other_block_must_be_is_refused(self):
    env = fixtures.fresh("unstack_stack")
    with self.assertRaisesRegex(ValueError, "no fair start of unstack_stack"):
      env.reset_to(tcp=(0.0, 0.5, 0.185), blue=pose(), fingers=0.0)

  def test_after_a_refused_reset_the_next_step_begins_an_episode(self):
    env = fixtures.fresh()
    env.reset()
    with self.assertRaisesRegex(ValueError, "cannot reach"):
      env.reset_to(tcp=(3.0, 0.5, 0.2))
    self.assertTrue(env.needs_reset)
    self.assertTrue(env.step(KEEP).first())

  @parameterized.parameters(
    ({"tcp": (0.0, 0.5)}, "tcp has shape"),
    ({"tcp": "here"}, "tcp is 'here'; valid: numbers"),
    ({"blue": (0.0, 0.5, 0.2, 0.0, 0.0, 0.0, 0.0)}, "blue has the quaternion"),
    ({"fingers": (1.0, 1.0)}, "fingers has shape"),
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

  @parameterized.parameters(
    ("published", (0.07, 0.0755), (0.065, 0.0755)),
    ("full_tray", (0.12, 0.131), (0.12, 0.151)),
  )
  def test_starts_fill_the_floor_they_are_for(self, spawn, of_blocks, of_tcp):
    env = fixtures.fresh(spawn=spawn)
    observed = [env.reset().observation for _ in range(40)]
    blocks, tcp = (
      np.reshape([seen[name] for seen in observed], (-1, 3))
      for name in ("block_positions", "ee_position")
    )
    for places, ends in ((blocks, of_blocks), (tcp, of_tcp)):
      away = np.abs(places[:, :2] - ws.CENTRE_XY).max(axis=0)
      self.assertBetween(away.min(), *ends)
      self.assertBetween(away.max(), *ends)
    heights = tcp[:, 2] - ws.FLOOR_Z
    self.assertBetween(heights.min(), 0.049, 0.06)
    self.assertBetween(heights.max(), 0.135, 0.146)

  def test_a_buffer_that_comes_and_goes_is_in_the_specification(self):
    env = lfgp_dmc.load("reach", 0)
    with self.assertRaisesRegex(ValueError, "seed is None; valid: 0 to"):
      env.reseed(None)
    observable = env.task.observables["ee_position"]
    for size, shape in ((3, (3, 3)), (None, (3,))):
      observable.buffer_size = size
      observed = env.reset().observation["ee_position"]
      self.assertEqual(observed.shape, shape)
      self.assertEqual(env.observation_spec()["ee_position"].shape, shape)
    env.close()

  @parameterized.parameters(
    ("juggle", {}, "juggle.*stack, unstack_stack"),
    ("stack", {"reward": "shaped"}, "sparse, dense"),
    ("stack", {"observations": "pixels"}, "features, vision"),
    ("stack", {"spawn": "table"}, "published, full_tray"),
    ("stack", {"control_hz": 7}, "20, 10, 5"),
    ("stack", {"time_limit": 0.0}, "time_limit"),
    ("stack", {"time_limit": "18"}, "time_limit='18'; valid is 0.05 s"),
    ("stack", {"camera_size": 64.5}, "camera_size is 64.5; valid: 32 to 480"),
    ("stack", {"seed": 1.5}, "seed is 1.5; valid: 0 to 4294967295"),
    ("stack", {"seed": -1}, "seed is -1; valid: 0 to 4294967295"),
    ("stack", {"colour": 1}, "unknown option colour; valid: reward, obs"),
  )
  def test_unknown_names_list_the_valid_ones(self, task, options, message):
    with self.assertRaisesRegex(ValueError, message):
      lfgp_dmc.load(task, **options)
