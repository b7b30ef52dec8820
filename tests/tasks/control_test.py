"""The arm answers actions as the released environment's does."""

import itertools

import numpy as np
from absl.testing import parameterized

from lfgp_dmc.tasks import control
from lfgp_dmc.tasks import workspace as ws
from tests.tasks import fixtures

# Section 9 of the released code's facts: TCP speed after each of the first
# five 50 ms steps of a constant unit action from rest, m/s.
_PUBLISHED = np.array([0.072, 0.118, 0.148, 0.166, 0.179])


class ControlTest(parameterized.TestCase):
  def setUp(self):
    super().setUp()
    self.env = fixtures.environment()

  def start(self, tcp, fingers=1.0):
    away = {
      "blue": fixtures.pose(-0.13, 0.38),
      "green": fixtures.pose(0.13, 0.38),
    }
    return self.env.reset_to(tcp=tcp, fingers=fingers, **away)

  def tilt(self) -> float:
    frame = self.env.physics.bind(self.env.task.world.panda.tcp).xmat
    turn = np.reshape(frame, (3, 3)) @ np.diag([1.0, -1.0, -1.0])
    return float(np.degrees(np.arccos(np.clip((turn.trace() - 1) / 2, -1, 1))))

  def set_point(self) -> np.ndarray:
    return np.array(self.env.physics.data.act)

  @parameterized.parameters(*itertools.product(range(3), (-1.0, 1.0)))
  def test_tcp_answers_a_unit_action_within_12_percent(self, axis, sign):
    for tcp in ((0, 0.5, 0.22), (-0.06, 0.44, 0.21), (0.06, 0.56, 0.22)):
      self.start(tcp)
      action = np.zeros(4)
      action[axis] = sign
      speeds = [
        sign * self.env.step(action).observation["ee_velocity"][axis]
        for _ in _PUBLISHED
      ]
      np.testing.assert_allclose(speeds, _PUBLISHED, rtol=0.12)

  def test_set_point_error_at_rest_is_under_1_mm_and_tilt_under_1_degree(self):
    corners = itertools.product((-0.14, 0.14), (0.36, 0.64), (0.2, 0.28))
    for tcp in [(0.0, 0.5, 0.15), *corners]:
      self.start(tcp, fingers=0.0)
      reached = fixtures.repeat(self.env, fixtures.KEEP, 40).observation
      error = np.linalg.norm(self.set_point() - reached["ee_position"])
      self.assertLess(error, 1e-3)
      self.assertLess(self.tilt(), 1.0)

  def test_set_point_accumulates_and_is_clipped_to_the_box(self):
    self.start((0.0, 0.5, 0.2))
    self.env.step([1.0, -0.5, 0.0, 0.0])
    np.testing.assert_allclose(self.set_point(), [0.01, 0.495, 0.2], atol=1e-4)
    fixtures.repeat(self.env, [1.0, 1.0, 1.0, 0.0], 40)
    np.testing.assert_allclose(self.set_point(), ws.SET_POINT_HIGH, atol=1e-9)

  def test_gripper_opens_below_0_closes_above_0_and_keeps_at_0(self):
    self.start((0.0, 0.5, 0.25))
    for command, opening in ((0.3, 0.0), (0.0, 0.0), (-0.3, 1.0), (0.0, 1.0)):
      timestep = fixtures.repeat(self.env, [0, 0, 0, command], 12)
      fingers = timestep.observation["finger_positions"][:2]
      np.testing.assert_allclose(fingers, opening, atol=0.02)

  def test_fingers_answer_as_the_published_first_order_lag(self):
    # Section 1.1: 0.5 -> open reads 0.705, 0.826, 0.897, 0.939.
    published = [0.705, 0.826, 0.897, 0.939]
    self.start((0.0, 0.5, 0.25), fingers=0.5)
    readings = [
      self.env.step([0, 0, 0, -1]).observation["finger_positions"][0]
      for _ in published
    ]
    np.testing.assert_allclose(readings, published, atol=0.04)

  @parameterized.parameters(
    ((1.0, 0.0, 0.0), 1.0),
    ((0.0, 1.0, 0.0), 1.1),
    ((0.0, 0.0, 1.0), 1.0),
    ((1.0, -1.0, 1.0), 2.5),
  )
  def test_tilt_stays_small_through_full_speed_reversals(self, way, degrees):
    self.start((0.0, 0.5, 0.24), fingers=0.0)
    worst = 0.0
    for turn, _ in itertools.product(range(10), range(4)):
      sign = 1.0 if turn % 2 else -1.0
      self.env.step([*np.multiply(sign, way), 0.0])
      worst = max(worst, self.tilt())
    self.assertLess(worst, degrees)


class CheckActionTest(parameterized.TestCase):
  def test_out_of_range_actions_are_clipped(self):
    clipped = control.check_action([2.0, -3.0, 0.5, 1.0])
    np.testing.assert_array_equal(clipped, [1.0, -1.0, 0.5, 1.0])

  @parameterized.parameters(
    ([0.0, 0.0, 0.0],), ([[0.0] * 4],), (0.0,), ([0.0] * 5,)
  )
  def test_a_wrong_shape_is_named(self, action):
    with self.assertRaisesRegex(ValueError, r"shape.*valid is \(4,\)"):
      control.check_action(action)

  def test_nan_is_refused(self):
    with self.assertRaisesRegex(ValueError, "NaN"):
      control.check_action([0.0, np.nan, 0.0, 0.0])
