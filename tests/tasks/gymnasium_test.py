"""The nine tasks through Gymnasium, by Gymnasium's own checker."""

import copy
import importlib.util
import unittest
import warnings

import numpy as np
from absl.testing import parameterized

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.task_names import ALL_TASKS
from tests.tasks import fixtures

if not all(map(importlib.util.find_spec, ("gymnasium", "shimmy"))):
  raise unittest.SkipTest("the extra gymnasium is not installed")

import gymnasium
from gymnasium.utils import env_checker

import lfgp_dmc.gymnasium

_IDS = {task: lfgp_dmc.gymnasium.environment_id(task) for task in ALL_TASKS}


class GymnasiumTest(parameterized.TestCase):
  @parameterized.parameters(*_IDS.items())
  def test_passes_gymnasiums_checker(self, task, name):
    env = gymnasium.make(name)
    self.assertEqual(env.unwrapped.task_name, task)
    with warnings.catch_warnings():
      warnings.simplefilter("error")
      # The 59 floats have no bounds, on purpose.
      warnings.filterwarnings("ignore", message=".*-?infinity.*")
      env_checker.check_env(env.unwrapped, skip_render_check=True)
    env.close()

  @parameterized.parameters(
    ({"render_mode": "nope"}, "render_mode 'nope'; valid: None, rgb_array"),
    ({"render_kwargs": {"fov": 4}}, "render_kwargs 'fov'; valid: height"),
    ({"render_kwargs": {"camera_id": "x"}}, "camera_id 'x'; valid: .*quarter"),
    ({"render_kwargs": {"height": 9000}}, "height is 9000; valid: 1 to "),
  )
  def test_what_no_picture_can_have_is_named(self, given, said):
    with self.assertRaisesRegex(ValueError, said):
      gymnasium.make(_IDS["reach"], **given)

  def test_an_unknown_start_is_named(self):
    env = gymnasium.make(_IDS["reach"])
    with self.assertRaisesRegex(ValueError, "'red'; valid: tcp, blue, green"):
      env.reset(options={"red": 1})
    env.close()

  def test_ids_are_the_tasks_names_in_camel_case(self):
    self.assertEqual(_IDS["unstack_stack"], "lfgp_dmc/UnstackStack-v0")

  def test_plays_as_the_environment_itself_does(self):
    env = gymnasium.make(_IDS["stack"], reward="dense", time_limit=1.0)
    own = lfgp_dmc.load("stack", seed=5, reward="dense", time_limit=1.0)
    observation, info = env.reset(seed=5)
    timestep = own.reset()
    random = np.random.default_rng(0)
    for step in range(20):
      flat = lfgp_dmc.flatten(timestep.observation)
      np.testing.assert_array_equal(observation, flat)
      successes = lfgp_dmc.successes(timestep.observation)
      self.assertEqual(info["successes"], successes)
      action = random.uniform(-1, 1, 4).astype(np.float32)
      observation, reward, terminated, truncated, info = env.step(action)
      timestep = own.step(action)
      self.assertEqual(reward, timestep.reward)
      self.assertFalse(terminated)
      self.assertEqual(truncated, step == 19)
    self.assertFalse(info["is_success"])
    self.assertFalse(info["physics_failure"])
    # The next episode goes on from the random state; the seed starts again.
    again = [env.reset()[0] for _ in range(2)]
    self.assertFalse(np.array_equal(*again))
    first = [env.reset(seed=9)[0] for _ in range(2)]
    np.testing.assert_array_equal(*first)
    large = [env.reset(seed=(1 << 32) + k)[0] for k in (0, 1, 0)]
    np.testing.assert_array_equal(large[0], large[2])
    self.assertFalse(np.array_equal(large[0], large[1]))
    env.close()

  def test_steps_environments_side_by_side(self):
    env = gymnasium.make_vec(
      _IDS["stack"],
      num_envs=2,
      vectorization_mode="async",
      vector_kwargs={"context": "spawn"},
    )
    env.reset(seed=[5, 6])
    actions = np.random.default_rng(0).uniform(-1, 1, (2, 4))
    together, *_, info = env.step(actions.astype(np.float32))
    self.assertEqual(info["is_success"].tolist(), [False, False])
    env.close()
    for seed, action, found in zip((5, 6), actions, together, strict=True):
      alone = fixtures.environment()
      alone.reseed(seed)
      alone.reset()
      expected = lfgp_dmc.flatten(alone.step(action).observation)
      np.testing.assert_allclose(found, expected, atol=1e-6)

  def test_a_step_after_the_end_asks_for_a_reset_and_copies_are_new(self):
    env = gymnasium.make(_IDS["reach"], time_limit=0.05)
    env.reset(seed=0)
    *_, truncated, _ = env.step(np.zeros(4, np.float32))
    self.assertTrue(truncated)
    with self.assertRaisesRegex(gymnasium.error.ResetNeeded, r"call reset\(\)"):
      env.step(np.zeros(4, np.float32))
    other = copy.deepcopy(env)
    np.testing.assert_array_equal(env.reset(seed=1)[0], other.reset(seed=1)[0])
    *_, truncated, _ = other.step(np.zeros(4, np.float32))
    self.assertTrue(truncated)

  def test_a_broken_simulation_is_reported_and_truncates(self):
    env = gymnasium.make(_IDS["reach"], control_hz=5)
    self.assertEqual(env.unwrapped.metadata["render_fps"], 5)
    env.reset(seed=0)
    env.unwrapped._env.physics.data.qvel[0] = np.nan
    step = env.unwrapped.step(np.zeros(4, np.float32))
    _, reward, terminated, truncated, info = step
    self.assertTrue(info["physics_failure"])
    self.assertTrue(truncated)
    self.assertFalse(terminated)
    self.assertEqual(reward, 0.0)
    env.close()

  def test_success_is_reported_and_does_not_end_the_episode(self):
    env = gymnasium.make(_IDS["reach"])
    blue = fixtures.pose()
    _, info = env.reset(options={"blue": blue, "tcp": blue[:3]})
    self.assertFalse(info["is_success"])
    for _ in range(15):
      _, _, terminated, truncated, info = env.step(np.zeros(4, np.float32))
    self.assertTrue(info["is_success"])
    self.assertTrue(info["conditions"]["reach"])
    self.assertFalse(terminated or truncated)
    env.close()

  def test_makes_pictures(self):
    if graphics.fault():
      self.skipTest(graphics.fault())
    size = {"height": 60, "width": 80}
    env = gymnasium.make(
      _IDS["bring"], render_mode="rgb_array", render_kwargs=size
    )
    env.reset(seed=0)
    self.assertEqual(env.render().shape, (60, 80, 3))
    self.assertEqual(env.metadata["render_fps"], 20)
    env.close()
    env = gymnasium.make(_IDS["bring"], observations="vision")
    observation, _ = env.reset(seed=0)
    self.assertTrue(env.observation_space.contains(observation))
    self.assertEqual(observation["camera/front"].shape, (64, 64, 3))
    self.assertFalse([k for k in observation if k.startswith("success/")])
    env.close()
