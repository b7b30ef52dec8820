"""Mirror images are what the simulator and the experts would have done."""

import numpy as np
from absl.testing import parameterized

from lfgp_dmc import flatten, observations
from lfgp_dmc.data import demonstration_checks
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import mirror
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import ScriptedExpert
from tests.tasks import fixtures

_STEPS = 100
# About twice the difference that one step in twenty exceeds, by component: the
# arm has one elbow and no mirror image, so that contacts differ a little.
_TOLERANCE = {
  "ee_velocity": 0.01,
  "finger_positions": 0.03,
  "block_rotations": 0.02,
  "block_linear_velocities": 0.02,
  "block_angular_velocities": 0.05,
}


def _begin(env, side):
  """Starts with both blocks askew; side -1 is the mirror image of 1."""

  def askew(x, away, yaw):
    half, y = side * yaw / 2, ws.CENTRE_XY[1] + side * away
    return fixtures.pose(x, y, quat=(np.cos(half), 0.0, 0.0, np.sin(half)))

  return env.reset_to(
    tcp=(0.0, 0.5 + side * 0.02, 0.2),
    blue=askew(0.03, 0.04, 0.3),
    green=askew(-0.05, -0.03, -0.2),
  )


def _play(env, timestep, act):
  """The observations of an attempt, and what was done in each."""
  rows, actions = [], []
  for step in range(_STEPS):
    rows.append(flatten(timestep.observation))
    actions.append(act(step, rows[-1]))
    timestep = env.step(actions[-1])
  return np.array(rows), np.array(actions)


def _expert(task, **options):
  expert = ScriptedExpert(noise=0.0, **options)
  expert.begin(task, 0)
  return lambda step, row: expert.act(row)


class MirrorTest(parameterized.TestCase):
  @parameterized.parameters(*(t for t in ALL_TASKS if t != "move_object"))
  def test_an_expert_does_in_the_image_the_image_of_what_it_does(self, task):
    env = fixtures.environment(task, control_hz=5)
    env.reseed(5)
    rows, _ = _play(env, env.reset(), _expert(task, control_hz=5))
    for row in rows:
      # From the same draw of the gripper's magnitude.
      image, action = (
        _expert(task, control_hz=5)(0, seen)
        for seen in (mirror.observation(row), row)
      )
      np.testing.assert_allclose(image, mirror.action(action), atol=1e-3)
    self.assertGreater(np.abs(mirror.observation(rows) - rows).max(), 0.01)

  def test_the_simulator_does_in_the_image_the_image_of_what_it_does(self):
    env = fixtures.environment()
    rows, actions = _play(env, _begin(env, 1), _expert("stack"))
    images, _ = _play(
      env, _begin(env, -1), lambda step, _: mirror.action(actions[step])
    )
    expected = mirror.observation(rows)
    error = np.quantile(np.abs(images - expected), 0.95, axis=0)
    for name, part in observations.OBSERVATION_SLICES.items():
      at = np.r_[part.slices]
      if name != "force_torque":
        self.assertLess(error[at].max(), _TOLERANCE.get(name, 0.001), name)
        continue
      for column in at:  # jolts: the sign tells
        pair = images[:, column], expected[:, column]
        self.assertGreater(np.corrcoef(*pair)[0, 1], 0.5, column)

  def test_twice_is_not_at_all(self):
    rows = np.random.default_rng(0).uniform(-1, 1, (5, 63)).astype(np.float32)
    again = mirror.observation(mirror.observation(rows[:, :59]))
    np.testing.assert_allclose(again, rows[:, :59], atol=1e-6)
    np.testing.assert_array_equal(
      mirror.action(mirror.action(rows[:, 59:])), rows[:, 59:]
    )

  def test_demonstrations_are_followed_by_their_images(self):
    random = np.random.default_rng(0)
    shown = Demonstrations(
      *(
        random.uniform(-1, 1, (6, width)).astype(np.float32)
        for width in (59, 4, 59)
      ),
      np.array([0, 0, 0, 1, 1, 2], np.int32),
      np.array([0, 0, 1, 0, 1, 0], bool),
    )
    both = mirror.with_images({"stack": shown, "move_object": shown})
    self.assertIs(both["move_object"], shown)
    found = both["stack"]
    self.assertEqual(
      found.episode.tolist(), [0, 0, 0, 1, 1, 2, 3, 3, 3, 4, 4, 5]
    )
    np.testing.assert_array_equal(found.is_last, np.tile(shown.is_last, 2))
    np.testing.assert_array_equal(found.action[6:, 1], -shown.action[:, 1])
    np.testing.assert_array_equal(found.observation[:6], shown.observation)
    np.testing.assert_array_equal(
      found.next_observation[6:], mirror.observation(shown.next_observation)
    )
    self.assertEmpty(demonstration_checks.of_arrays(found.arrays(), None, None))
