"""Foreign environments are driven by their own specs, or refused."""

import numpy as np
from absl.testing import absltest, parameterized
from dm_env import specs

from lfgp_dmc import observations, toy
from lfgp_dmc.acting import environments, rollout, wrappers
from lfgp_dmc.finite import NotFiniteError


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
    env = wrappers.with_unit_actions(foreign)
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
    self.assertIs(wrappers.with_unit_actions(env), env)

  @parameterized.parameters(
    specs.DiscreteArray(4),
    specs.Array((2,), np.float32),
    specs.BoundedArray((2,), np.float32, -np.inf, np.inf),
    specs.BoundedArray((2,), np.int32, -1, 1),
    [[specs.BoundedArray((2,), np.float32, -1, 1)]],
  )
  def test_refuses_what_cannot_be_learned(self, spec):
    with self.assertRaisesRegex(ValueError, "valid: floats with finite bounds"):
      wrappers.with_unit_actions(_Foreign(spec))

  @parameterized.parameters(
    [[specs.Array((2,), np.float32)]],
    ({"arm": {"angle": specs.Array((2,), np.float32)}},),
  )
  def test_refuses_observations_that_are_not_arrays_of_floats(self, spec):
    with self.assertRaisesRegex(ValueError, "valid: "):
      environments.widths(
        _Foreign(specs.BoundedArray((2,), float, -1, 1), spec)
      )


class _Cameras(toy.PointEnvironment):
  """Gives its two cameras in another order than its specification."""

  def observation_spec(self):
    frame = specs.Array((4, 4, 3), np.uint8)
    return {
      **super().observation_spec(), "camera/a": frame, "camera/b": frame
    }  # fmt: skip

  def _observe(self):
    frames = {f"camera/{k}": np.full((4, 4, 3), n, np.uint8)
              for k, n in (("b", 2), ("a", 1))}  # fmt: skip
    return {**frames, **super()._observe()}


class _Broken(toy.PointEnvironment):
  """Loses its position in the third step, as of a sensor's fault."""

  def __init__(self, value, fail_every=0):
    super().__init__(fail_every=fail_every)
    self._value = value

  def _observe(self):
    seen = super()._observe()
    if self._steps == 3 or (self._fail_every and self._steps >= 10):
      seen["position"] = np.array([0, self._value])
    return seen


class NotFiniteTest(parameterized.TestCase):
  def _play(self, environment):
    return list(
      rollout.steps(environment, environment.reset(), lambda _: np.zeros(2))
    )

  @parameterized.parameters(np.nan, np.inf, 1e300)  # the last one as float32
  def test_is_refused_with_the_step_and_the_name(self, value):
    with (
      np.errstate(over="ignore"),
      self.assertRaisesRegex(
        NotFiniteError, "at step 3 of its episode has NaN or .* in position"
      ),
    ):
      self._play(_Broken(value))

  def test_a_physics_failure_may_end_in_it(self):
    class Failing(_Broken):
      def _observe(self):
        self._value = np.nan if self._steps >= 10 else 0.0
        return super()._observe()

    *_, last = self._play(Failing(0.0, fail_every=1))
    self.assertTrue(environments.is_physics_failure(last.timestep))


class FlattenerTest(absltest.TestCase):
  def test_an_array_that_is_filled_again_is_copied(self):
    reused = np.zeros(2, np.float32)
    spec = specs.Array((2,), np.float32)
    foreign = _Foreign(specs.BoundedArray((2,), float, -1, 1), spec)
    before = environments.flattener(foreign)(reused)
    reused += 1
    np.testing.assert_array_equal(before, [0, 0])

  def test_cameras_are_in_the_order_of_the_specification(self):
    flat = environments.flattener(_Cameras())(_Cameras().reset().observation)
    np.testing.assert_array_equal(flat[2::48], [1, 2])

    def encode(frames):
      return frames[:, :, 0, 0, 0].astype(np.float32)

    encoded = wrappers.with_features(_Cameras(), encode)
    observed = encoded.reset().observation
    flat = environments.flattener(encoded)(observed)
    np.testing.assert_array_equal(flat[2:], [1, 2])

  def test_beside_all_block_components_frames_are_left_out(self):
    frame = specs.Array((4, 4, 3), np.uint8)
    parts = {
      name: specs.Array((part.size,), np.float32)
      for name, part in observations.OBSERVATION_SLICES.items()
    }
    foreign = _Foreign(
      specs.BoundedArray((2,), float, -1, 1), {**parts, "camera/a": frame}
    )
    self.assertEqual(environments.widths(foreign), (59, 2))
    observed = {
      k: np.random.default_rng(0).random(v.shape)
      for k, v in foreign._observation_spec.items()
    }
    self.assertEqual(environments.frame_shape(foreign), ())
    flat = environments.flattener(foreign)(observed)
    np.testing.assert_array_equal(flat, observations.flatten(observed))
