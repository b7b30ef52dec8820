"""Shifted copies are what the experts would have done elsewhere."""

import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc import flatten
from lfgp_dmc.data import demonstration_checks
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import translation
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import ScriptedExpert
from tests.tasks import fixtures

_STEPS = 40
_BOUND = ("bring", "insert", "move_object")  # to slots; to the circle's centre
_SHIFT = np.array([0.02, -0.03], np.float32)


def _attempt(task, shift=(0.0, 0.0), actions=None):
  """Observations and actions of an attempt that starts so far away."""
  x, y = shift
  env = fixtures.environment(task, control_hz=5)
  timestep = env.reset_to(
    tcp=(x, 0.5 + y, 0.2),
    blue=fixtures.pose(0.03 + x, 0.54 + y),
    green=fixtures.pose(-0.05 + x, 0.47 + y),
  )
  expert = ScriptedExpert(noise=0.0, control_hz=5)
  expert.begin(task, 0)
  rows, done = [], []
  for step in range(_STEPS):
    rows.append(flatten(timestep.observation))
    done.append(expert.act(rows[-1]) if actions is None else actions[step])
    timestep = env.step(done[-1])
  return np.array(rows), np.array(done)


class TranslationTest(parameterized.TestCase):
  @parameterized.parameters(*(t for t in ALL_TASKS if t not in _BOUND))
  def test_an_expert_does_the_same_elsewhere(self, task):
    rows, _ = _attempt(task)
    moved = translation.observation(rows, np.tile(_SHIFT, (len(rows), 1)))
    for here, there in zip(rows, moved, strict=True):
      one, other = (
        ScriptedExpert(noise=0.0, control_hz=5) for _ in range(2)
      )  # from the same draw of the gripper's magnitude
      for expert in (one, other):
        expert.begin(task, 0)
      np.testing.assert_allclose(one.act(here), other.act(there), atol=1e-3)

  def test_the_simulator_does_the_same_elsewhere(self):
    rows, actions = _attempt("stack")
    found, _ = _attempt("stack", _SHIFT, actions)
    expected = translation.observation(rows, np.tile(_SHIFT, (len(rows), 1)))
    error = np.quantile(np.abs(found - expected)[:, :53], 0.95, axis=0)
    self.assertLess(error.max(), 0.05)
    for name in ("ee_position", "block_positions", "slots_from_blocks"):
      at = np.r_[translation.OBSERVATION_SLICES[name].slices]
      self.assertLess(error[at].max(), 0.002, name)
      self.assertGreater(np.abs(found - rows)[:, at].max(), 0.01, name)

  def test_copies_are_attempts_of_their_own_within_the_box(self):
    rows, actions = _attempt("stack")
    shown = Demonstrations(
      rows,
      actions.astype(np.float32),
      rows,
      np.repeat(np.array([3, 5], np.int32), [15, 25]),
      np.isin(np.arange(40), (14,)),
    )
    generator = np.random.default_rng(0)
    given = {"stack": shown, "bring": shown}
    both = translation.with_copies(given, 20, generator)
    self.assertIs(both["bring"], shown)
    found = both["stack"]
    self.assertLen(found, 21 * 40)
    self.assertEqual(found.attempts, 21)
    np.testing.assert_array_equal(found.observation[:40], rows)
    np.testing.assert_array_equal(found.action[-40:], shown.action)
    self.assertEmpty(demonstration_checks.of_arrays(found.arrays(), None, None))
    shift = (found.observation - np.tile(rows, (21, 1)))[:, 12:14]
    self.assertBetween(np.abs(shift).max(), 0.07, 0.0801)
    for episode in np.unique(found.episode):
      of_attempt = shift[found.episode == episode]
      np.testing.assert_allclose(np.ptp(of_attempt, axis=0), 0, atol=1e-6)
    self.assertLen(np.unique(shift.round(4), axis=0), 41)
    places = found.observation[:, translation._POSITIONS]
    self.assertTrue((places > np.array(ws.SET_POINT_LOW[:2]) - 0.01).all())
    self.assertTrue((places < np.array(ws.SET_POINT_HIGH[:2]) + 0.01).all())


if __name__ == "__main__":
  absltest.main()
