"""The 59 floats: values against the simulator, rotations against symmetry."""

import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc.tasks import features
from lfgp_dmc.tasks import workspace as ws

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def _multiply(a, b):
  w, x, y, z = a
  return np.array(
    [
      w * b[0] - x * b[1] - y * b[2] - z * b[3],
      w * b[1] + x * b[0] + y * b[3] - z * b[2],
      w * b[2] - x * b[3] + y * b[0] + z * b[1],
      w * b[3] + x * b[2] - y * b[1] + z * b[0],
    ]
  )


class ReduceRotationTest(absltest.TestCase):
  def test_equal_looking_cubes_read_equal(self):
    rng = np.random.default_rng(0)
    quarter = np.sqrt(0.5)
    turns = [
      np.array([quarter, quarter, 0, 0]),
      np.array([quarter, 0, quarter, 0]),
      np.array([quarter, 0, 0, quarter]),
    ]
    for _ in range(50):
      quat = rng.normal(size=4)
      quat /= np.linalg.norm(quat)
      reduced = features.reduce_rotation(quat)
      for turn in turns:
        other = features.reduce_rotation(_multiply(quat, turn))
        np.testing.assert_allclose(other, reduced, atol=1e-12)
      negated = features.reduce_rotation(-quat)
      np.testing.assert_allclose(negated, reduced, atol=1e-12)

  def test_angle_is_at_most_that_between_a_cube_and_its_nearest_pose(self):
    # 62.8 degrees is the farthest that a rotation is from the cube's group.
    rng = np.random.default_rng(1)
    quats = rng.normal(size=(2000, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    angles = [2 * np.arccos(features.reduce_rotation(q)[0]) for q in quats]
    self.assertLess(np.degrees(max(angles)), 62.81)

  def test_small_yaw_is_kept_and_a_quarter_turn_removed(self):
    small = np.array([np.cos(0.1), 0, 0, np.sin(0.1)])
    np.testing.assert_allclose(features.reduce_rotation(small), small)
    large = np.array([np.cos(0.1 + np.pi / 4), 0, 0, np.sin(0.1 + np.pi / 4)])
    np.testing.assert_allclose(
      features.reduce_rotation(large), small, atol=1e-12
    )


class FeaturesTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.env = lfgp_dmc.load("stack", seed=0)

  def test_layout_is_the_released_order(self):
    timestep = self.env.reset_to(
      tcp=(0.05, 0.45, 0.25),
      blue=[0.03, 0.52, ws.FLAT_Z, *_UPRIGHT],
      green=[-0.1, 0.6, ws.FLAT_Z, *_UPRIGHT],
      fingers=0.5,
    )
    flat = lfgp_dmc.flatten(timestep.observation)
    expected = {
      (0, 3): [0.05, 0.45, 0.25],
      (3, 6): [0, 0, 0],
      (6, 12): [0.5] * 6,
      (12, 15): [0.03, 0.52, 0.145],
      (15, 19): _UPRIGHT,
      (19, 22): [-0.1, 0.6, 0.145],
      (22, 26): _UPRIGHT,
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
    self.env.reset_to(
      tcp=(0.0, 0.5, 0.27), blue=[0.0, 0.6, ws.FLAT_Z, *_UPRIGHT]
    )
    readings = []
    for _ in range(4):
      observed = self.env.step([0, 0, 0, 1.0]).observation
      readings.append(observed["finger_positions"])
    now = [reading[:2] for reading in readings]
    np.testing.assert_array_equal(readings[3][2:4], now[1])
    np.testing.assert_array_equal(readings[3][4:6], now[2])
    self.assertLess(now[3][0], now[2][0])

  def test_velocities_are_rates_of_positions(self):
    self.env.reset_to(
      tcp=(0.0, 0.5, 0.25), blue=[0.0, 0.6, ws.FLAT_Z, *_UPRIGHT]
    )
    for _ in range(20):
      before = self.env.step([0.5, 0, 0, 0]).observation["ee_position"]
    observed = self.env.step([0.5, 0, 0, 0]).observation
    rate = (observed["ee_position"] - before) / 0.05
    np.testing.assert_allclose(observed["ee_velocity"], rate, atol=2e-3)


if __name__ == "__main__":
  absltest.main()
