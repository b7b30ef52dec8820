"""Foreign environments are driven by their own specs, or refused."""

import numpy as np
from absl.testing import parameterized
from dm_env import specs

from lfgp_dmc import toy
from lfgp_dmc.acting import environments


class _Foreign(toy.PointEnvironment):
  """Keeps the action that it got."""

  def __init__(self, spec, observation_spec=None):
    super().__init__()
    self._action_spec, self._observation_spec = spec, observation_spec

  def action_spec(self):
    return self._action_spec

  def observation_spec(self):
    return self._observation_spec or super().observation_spec()

  def step(self, action):
    self.action = action
    return super().step(np.ravel(action)[:2])


class UnitActionsTest(parameterized.TestCase):
  @parameterized.parameters(
    ((2,), -2.0, 2.0, [-1, 0.5], [-2, 1]),
    ((2,), 0.0, 1.0, [-1, 0], [0, 0.5]),
    ((2,), [-1, 0], [1, 4], [3, 0], [1, 2]),  # what is too large is clipped
    ((2, 1), -1.0, 1.0, [1, 0], [[1], [0]]),
  )
  def test_rescales_to_the_bounds(self, shape, low, high, action, expected):
    spec = specs.BoundedArray(shape, np.float64, low, high)
    foreign = _Foreign(spec)
    env = environments.with_unit_actions(foreign)
    env.reset()
    self.assertTrue(env.step(np.asarray(action, np.float32)).mid())
    np.testing.assert_allclose(foreign.action, expected)
    self.assertEqual(foreign.action.dtype, np.float64)
    spec.validate(foreign.action)
    unit = env.action_spec()
    self.assertEqual((unit.shape, unit.minimum, unit.maximum), ((2,), -1, 1))
    self.assertEqual(environments.widths(env), (2, 2))

  def test_unit_actions_are_left_alone(self):
    env = toy.PointEnvironment()
    self.assertIs(environments.with_unit_actions(env), env)

  @parameterized.parameters(
    specs.DiscreteArray(4),
    specs.Array((2,), np.float32),
    specs.BoundedArray((2,), np.float32, -np.inf, np.inf),
    specs.BoundedArray((2,), np.int32, -1, 1),
    [[specs.BoundedArray((2,), np.float32, -1, 1)]],
  )
  def test_refuses_what_cannot_be_learned(self, spec):
    with self.assertRaisesRegex(ValueError, "valid: floats with finite bounds"):
      environments.with_unit_actions(_Foreign(spec))

  @parameterized.parameters(
    [[specs.Array((2,), np.float32)]],
    ({"arm": {"angle": specs.Array((2,), np.float32)}},),
  )
  def test_refuses_observations_that_are_not_arrays_of_floats(self, spec):
    with self.assertRaisesRegex(ValueError, "valid: "):
      environments.widths(
        _Foreign(specs.BoundedArray((2,), float, -1, 1), spec)
      )
