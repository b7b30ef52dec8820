"""Pictures: the two cameras, and observations="vision"."""

import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.observations import OBSERVATION_SLICES, flatten_vision
from lfgp_dmc.pictures import recorder
from tests.tasks import fixtures


@absltest.skipIf(graphics.fault(), graphics.fault())
class RenderingTest(parameterized.TestCase):
  @parameterized.parameters("front", "three_quarter")
  def test_camera_sees_both_blocks_and_zones(self, camera):
    env = fixtures.fresh()
    env.reset()
    picture = env.physics.render(240, 320, camera_id=camera).astype(int)
    red, green, blue = np.moveaxis(picture, -1, 0)
    self.assertGreater(np.mean(blue > 1.5 * np.maximum(red, green)), 0.002)
    self.assertGreater(np.mean(green > 1.5 * np.maximum(red, blue)), 0.002)

  def test_vision_shows_cameras_and_leaves_privileged_parts_out(self):
    env = lfgp_dmc.load("stack", seed=0, observations="vision")
    timestep = env.reset()
    first = timestep.observation["camera/front"]
    self.assertEqual((first.shape, first.dtype), ((64, 64, 3), np.uint8))
    for name, component in OBSERVATION_SLICES.items():
      self.assertEqual(name in timestep.observation, not component.privileged)
    self.assertLen(lfgp_dmc.successes(timestep.observation), 9)
    timestep = fixtures.repeat(env, [0.0, 0.0, -1.0, 1.0], 10)
    moved = timestep.observation["camera/front"]
    self.assertFalse(np.array_equal(first, moved))
    flat = lfgp_dmc.flatten(timestep.observation)
    self.assertEqual(flat.shape, (18 + 2 * 64 * 64 * 3,))
    wrist = timestep.observation["camera/wrist"]
    np.testing.assert_array_equal(flat[-wrist.size :], wrist.ravel())
    np.testing.assert_array_equal(flat[18 : 18 + moved.size], moved.ravel())
    env.close()

  def test_all_shows_the_state_beside_the_frames(self):
    env = lfgp_dmc.load("stack", 0, observations="all", camera_size=32)
    seen = env.reset().observation
    self.assertEqual(seen["camera/wrist"].shape, (32, 32, 3))
    self.assertEqual(lfgp_dmc.flatten(seen).shape, (59,))
    self.assertEqual(flatten_vision(seen).shape, (18 + 2 * 32 * 32 * 3,))
    env.close()

  def test_frames_stay_as_they_are_while_a_film_is_made(self):
    env = lfgp_dmc.load("lift", 0, observations="vision", camera_size=32)
    before = env.reset().observation
    recorder.prepare(env, recorder.Look(shadows=False))
    picture = env.physics.render(60, 80, camera_id="three_quarter")
    self.assertGreater(np.ptp(picture), 0)
    env.reseed(0)
    again = env.reset().observation
    for name in ("camera/front", "camera/wrist"):
      np.testing.assert_array_equal(before[name], again[name])
    env.close()

  def test_wrist_camera_sees_fingers_and_block(self):
    env = lfgp_dmc.load("reach", 0, observations="vision")
    above = [0.0, 0.5, 0.16]
    seen = env.reset_to(
      tcp=above, blue=[0, 0.5, 0.145, 1, 0, 0, 0], fingers=1.0
    ).observation["camera/wrist"]
    red, _, blue = np.moveaxis(seen.astype(int), -1, 0)
    self.assertGreater(np.mean(blue > 1.5 * red), 0.03)
    self.assertGreater(np.mean(seen.max(-1) < 90), 0.02)
    env.close()
