"""The 59 floats: values against the simulator, rotations against symmetry."""

import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc.tasks.rotations import reduce_rotation
from tests.tasks import fixtures
from tests.tasks.fixtures import UPRIGHT, pose


def _multiply(a, b):
  w, x, y, z = a
  left = [[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]
  return np.array(left) @ b


class ReduceRotationTest(absltest.TestCase):
  def test_equal_looking_cubes_read_equal(self):
    rng = np.random.default_rng(0)
    turns = np.sqrt(0.5) * np.array([[1, 1, 0, 0], [1, 0, 1, 0], [1, 0, 0, 1]])
    for _ in range(50):
      quat = rng.normal(size=4)
      quat /= np.linalg.norm(quat)
      reduced = reduce_rotation(quat)
      for other in (-quat, *(_multiply(quat, turn) for turn in turns)):
        np.testing.assert_allclose(reduce_rotation(other), reduced, atol=1e-12)

  def test_angle_is_at_most_that_between_a_cube_and_its_nearest_pose(self):
    # 62.8 degrees is the farthest that a rotation is from the cube's group.
    quats = np.random.default_rng(1).normal(size=(2000, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    angles = 2 * np.arccos(reduce_rotation(quats)[:, 0])
    self.assertLess(np.degrees(angles.max()), 62.81)

  def test_small_yaw_is_kept_and_a_quarter_turn_removed(self):
    small = np.array([np.cos(0.1), 0, 0, np.sin(0.1)])
    np.testing.assert_allclose(reduce_rotation(small), small)
    large = np.array([np.cos(0.1 + np.pi / 4), 0, 0, np.sin(0.1 + np.pi / 4)])
    np.testing.assert_allclose(reduce_rotation(large), small, atol=1e-12)


class FeaturesTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.env = fixtures.environment()

  def test_layout_is_the_released_order(self):
    timestep = self.env.reset_to(
      tcp=(0.05, 0.45, 0.25),
      blue=pose(0.03, 0.52),
      green=pose(-0.1, 0.6),
      fingers=0.5,
    )
    flat = lfgp_dmc.flatten(timestep.observation)
    expected = {
      (0, 3): [0.05, 0.45, 0.25],
      (3, 6): [0, 0, 0],
      (6, 12): [0.5] * 6,
      (12, 15): [0.03, 0.52, 0.145],
      (15, 19): UPRIGHT,
      (19, 22): [-0.1, 0.6, 0.145],
      (22, 26): UPRIGHT,
      (26, 38): [0] * 12,
      (38, 41): [-0.02, 0.07, -0.105],
      (41, 44): [-0.15, 0.15, -0.105],
      (44, 47): [-0.13, 0.08, 0],
      (47, 50): [0.045, -0.02, -0.01],
      (50, 53): [0.025, -0.1, -0.01],
    }
    for (start, stop), values in expected.items():
      np.testing.assert_allclose(
        flat[start:stop], values, atol=2e-4, err_msg=f"{start}:{stop}"
      )

  def test_finger_history_is_now_then_two_steps_ago_then_one(self):
    self.env.reset_to(tcp=(0.0, 0.5, 0.27), blue=pose(0.0, 0.6))
    readings = [
      self.env.step([0, 0, 0, 1.0]).observation["finger_positions"]
      for _ in range(4)
    ]
    now = [reading[:2] for reading in readings]
    np.testing.assert_array_equal(readings[3][2:4], now[1])
    np.testing.assert_array_equal(readings[3][4:6], now[2])
    self.assertLess(now[3][0], now[2][0])

  def test_velocities_are_rates_of_positions(self):
    self.env.reset_to(tcp=(0.0, 0.5, 0.25), blue=pose(0.0, 0.6))
    before = fixtures.repeat(self.env, [0.5, 0, 0, 0], 20).observation
    after = self.env.step([0.5, 0, 0, 0]).observation
    rate = (after["ee_position"] - before["ee_position"]) / 0.05
    np.testing.assert_allclose(after["ee_velocity"], rate, atol=2e-3)

  def test_a_block_that_falls_accelerates_by_gravity_and_is_not_moved(self):
    self.env.reset_to(tcp=(0.1, 0.6, 0.28), blue=pose(-0.1, 0.4, 0.3))
    falling = fixtures.repeat(self.env, fixtures.KEEP, 2).observation
    self.assertLess(falling["block_linear_velocities"][2], -0.5)
    self.assertFalse(falling["condition/move_object"])
    snapshot = self.env.task.world.reader.snapshot(
      self.env.physics, fixtures.KEEP, moved=True
    )
    self.assertAlmostEqual(snapshot.blue_acceleration, 9.81, places=3)

  def test_torques_are_tanh_of_their_share_of_10_newton_metres(self):
    self.env.reset_to(tcp=(0.0, 0.5, 0.25), blue=pose(0.0, 0.6))
    task, physics = self.env.task, self.env.physics
    sensor = task.world.panda.sensors["torque"]

    def torque():
      return np.array(physics.bind(sensor).sensordata)

    at_rest = torque()
    moving = self.env.step([1.0, -1.0, 0.0, 0.0]).observation
    added = torque() - at_rest
    self.assertGreater(np.abs(added).max(), 0.05)
    read = np.arctanh(moving["force_torque"][3:]) * 10.0
    np.testing.assert_allclose(read, added, atol=0.01)

  def test_wrist_reads_zero_unloaded_and_the_weight_of_a_block(self):
    self.env.reset_to(tcp=pose()[:3], blue=pose(), green=pose(0.1, 0.6))
    unloaded = fixtures.repeat(self.env, fixtures.KEEP, 5).observation
    np.testing.assert_allclose(unloaded["force_torque"], 0.0, atol=1e-3)
    fixtures.repeat(self.env, [0, 0, 0, 1.0], 12)
    fixtures.repeat(self.env, [0, 0, 1.0, 1.0], 10)
    loaded = fixtures.repeat(self.env, [0, 0, 0, 1.0], 20).observation
    force = np.linalg.norm(np.arctanh(loaded["force_torque"][:3])) * 100.0
    self.assertAlmostEqual(force, 0.1 * 9.81, delta=0.05)
