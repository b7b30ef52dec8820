"""Environments side by side: the states of single ones, and clear errors."""

import functools

import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc import toy
from lfgp_dmc.vector import VectorEnvironment

STEPS = 45


def _broken():
  raise OSError("no such world")


def _toys(count):
  return VectorEnvironment(
    [functools.partial(toy.PointEnvironment, seed) for seed in range(count)]
  )


class VectorEnvironmentTest(absltest.TestCase):
  def test_goes_through_the_states_of_the_single_environments(self):
    singles = [toy.PointEnvironment(seed) for seed in range(3)]
    random = np.random.default_rng(0)
    with _toys(3) as vector:
      steps = vector.reset(), [single.reset() for single in singles]
      for _ in range(STEPS):  # over two ends of episodes
        together, apart = steps
        for index, alone in enumerate(apart):
          self.assertEqual(together.step_type[index], alone.step_type)
          self.assertEqual(together.reward[index], alone.reward or 0.0)
          for name, value in alone.observation.items():
            np.testing.assert_array_equal(
              together.observation[name][index], value
            )
        actions = random.uniform(-1, 1, (3, 2))
        steps = (
          vector.step(actions),
          [
            single.step(action)
            for single, action in zip(singles, actions, strict=True)
          ],
        )

  def test_block_worlds_equal_single_ones_bit_for_bit(self):
    random = np.random.default_rng(0)
    singles = [lfgp_dmc.load("stack", 5), lfgp_dmc.load("stack", 6)]
    with lfgp_dmc.load_vector("stack", 2, seed=5) as vector:
      together, apart = vector.reset(), [one.reset() for one in singles]
      for _ in range(20):
        rows = lfgp_dmc.flatten(together.observation)
        self.assertEqual(rows.shape, (2, 59))
        for row, alone in zip(rows, apart, strict=True):
          np.testing.assert_array_equal(
            row, lfgp_dmc.flatten(alone.observation)
          )
        actions = random.uniform(-1, 1, (2, 4))
        together = vector.step(actions)
        apart = [s.step(a) for s, a in zip(singles, actions, strict=True)]

  def test_reseeding_fixes_the_next_starts(self):
    with _toys(2) as vector:
      starts = []
      for _ in range(2):
        vector.reseed([7, 7])
        starts.append(vector.reset().observation["position"])
      np.testing.assert_array_equal(starts[0][0], starts[0][1])
      np.testing.assert_array_equal(*starts)

  def test_bad_actions_are_refused_and_change_nothing(self):
    with _toys(2) as vector:
      vector.reset()
      with self.assertRaisesRegex(ValueError, r"shape \(3, 2\); valid is"):
        vector.step(np.zeros((3, 2)))
      with self.assertRaisesRegex(ValueError, "NaN"):
        vector.step(np.full((2, 2), np.nan))
      self.assertFalse(vector.step(np.zeros((2, 2))).last().any())

  def test_an_environment_that_cannot_be_built_is_told(self):
    with self.assertRaisesRegex(RuntimeError, "environment 0 could not"):
      VectorEnvironment([_broken])


if __name__ == "__main__":
  absltest.main()
