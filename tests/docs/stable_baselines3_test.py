"""Stable-Baselines3 trains on a block task, by the page's own code."""

import importlib.util
import unittest

from absl.testing import absltest

from tests.docs import pages


@unittest.skipUnless(
  importlib.util.find_spec("stable_baselines3"),
  "the extra sb3 is not installed",
)
class StableBaselines3Test(absltest.TestCase):
  def test_trains_on_reach(self):
    code = pages.run("stable_baselines3.md")
    agent = code["train"](510)
    self.assertEqual(agent.num_timesteps, 510)
    self.assertBetween(code["success_rate"](agent, 1), 0, 1)


if __name__ == "__main__":
  absltest.main()
