"""Mirror images are what the simulator and the experts would have done."""

import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc import flatten, observations, tasks
from lfgp_dmc.data import demonstration_checks
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks import mirror
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.experts import ScriptedExpert

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


def _pose(x, y, yaw, side):
  half = side * yaw / 2
  y = ws.CENTRE_XY[1] + side * (y - ws.CENTRE_XY[1])
  return (x, y, ws.FLAT_Z, np.cos(half), 0.0, 0.0, np.sin(half))


def _begin(environment, side):
  """Starts with both blocks askew; side -1 is the mirror image of 1."""
  return environment.reset_to(
    tcp=(0.0, 0.5 + side * 0.02, 0.2),
    blue=_pose(0.03, 0.54, 0.3, side),
    green=_pose(-0.05, 0.47, -0.2, side),
  )


def _attempt(task, steps=_STEPS):
  environment = tasks.load(task, seed=5, control_hz=5)
  expert = ScriptedExpert(noise=0.0, control_hz=5)
  expert.begin(task, 0)
  timestep = environment.reset()
  rows = []
  for _ in range(steps):
    rows.append(flatten(timestep.observation))
    timestep = environment.step(expert.act(rows[-1]))
  return np.array(rows)


class MirrorTest(parameterized.TestCase):
  @parameterized.parameters(*(t for t in ALL_TASKS if t != "move_object"))
  def test_an_expert_does_in_the_image_the_image_of_what_it_does(self, task):
    expert = ScriptedExpert(noise=0.0, control_hz=5)

    def act(row):
      expert.begin(task, 0)
      return expert.act(row)

    rows = _attempt(task)
    for row in rows:
      np.testing.assert_allclose(
        act(mirror.observation(row)), mirror.action(act(row)), atol=1e-3
      )
    self.assertGreater(np.abs(mirror.observation(rows) - rows).max(), 0.01)

  def test_the_simulator_shows_in_the_image_the_image_of_what_it_shows(self):
    environment = tasks.load("stack", seed=0)
    expert = ScriptedExpert(noise=0.0)
    expert.begin("stack", 0)
    timestep = _begin(environment, 1)
    rows, actions = [], []
    for _ in range(_STEPS):
      rows.append(flatten(timestep.observation))
      actions.append(expert.act(rows[-1]))
      timestep = environment.step(actions[-1])
    timestep = _begin(environment, -1)
    images = []
    for action in actions:
      images.append(flatten(timestep.observation))
      timestep = environment.step(mirror.action(action))
    expected = mirror.observation(np.array(rows))
    error = np.quantile(np.abs(images - expected), 0.95, axis=0)
    for name, part in observations.OBSERVATION_SLICES.items():
      at = np.r_[part.slices]
      if name != "force_torque":
        self.assertLess(error[at].max(), _TOLERANCE.get(name, 0.001), name)
        continue
      for column in at:  # jolts: the sign tells
        pair = np.array(images)[:, column], expected[:, column]
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


if __name__ == "__main__":
  absltest.main()
