"""Pictures: the two cameras, and observations="vision"."""

import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.observations import OBSERVATION_SLICES
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

  def test_vision_shows_a_camera_and_leaves_privileged_parts_out(self):
    env = lfgp_dmc.load("stack", seed=0, observations="vision")
    timestep = env.reset()
    first = timestep.observation["camera/front"]
    self.assertEqual((first.shape, first.dtype), ((84, 84, 3), np.uint8))
    for name, component in OBSERVATION_SLICES.items():
      self.assertEqual(name in timestep.observation, not component.privileged)
    self.assertLen(lfgp_dmc.successes(timestep.observation), 9)
    timestep = fixtures.repeat(env, [0.0, 0.0, -1.0, 1.0], 10)
    moved = timestep.observation["camera/front"]
    self.assertFalse(np.array_equal(first, moved))
    with self.assertRaisesRegex(KeyError, "block_positions"):
      lfgp_dmc.flatten(timestep.observation)
    env.close()
