"""Environments by a path, from where the user is."""

import contextlib
import sys

from absl.testing import parameterized

from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from tests import fixtures

_SOURCE = """
import numpy as np
from dm_env import specs
from lfgp_dmc import toy
class Wide(toy.PointEnvironment):
  def action_spec(self):
    return specs.BoundedArray((2,), np.float64, -2.0, 2.0)
class Discrete(toy.PointEnvironment):
  def action_spec(self):
    return specs.DiscreteArray(3)
def wide(seed): return Wide()
def with_size(size): return Wide()
def nothing(): return None
"""


class EnvironmentSpecTest(fixtures.FolderTest, parameterized.TestCase):
  def setUp(self):
    super().setUp()
    (self.folder / "my_own_world.py").write_text(_SOURCE)
    self.enter_context(contextlib.chdir(self.folder))
    path = [p for p in sys.path if p]
    self.addCleanup(sys.path.__setitem__, slice(None), sys.path[:])
    sys.path[:] = path

  def test_is_found_in_the_working_directory_and_rescaled(self):
    env = EnvironmentSpec("right", "my_own_world:wide").build()
    self.assertEqual(env.action_spec().maximum, 1.0)

  @parameterized.parameters(([1], ""), (None, ""), ("right", 3))
  def test_what_is_no_text_is_named(self, *names):
    with self.assertRaisesRegex(ValueError, "config.*valid: a text"):
      EnvironmentSpec(*names).check()

  @parameterized.parameters(
    ("my_own_world:with_size", "missing a required argument: 'size'; valid"),
    ("my_own_world:nowhere", "no attribute 'nowhere'; valid"),
    ("no_such_world:make", "looked in .* and on Python"),
    (":make", "Empty module name"),
    ("my_own_world:_SOURCE", "has no attribute"),
    ("my_own_world:Discrete", "DiscreteArray.*valid: floats"),
    ("my_own_world:nothing", "'NoneType' object has no attribute"),
  )
  def test_one_line_says_what_is_wrong(self, path, message):
    with self.assertRaisesRegex(ValueError, message):
      EnvironmentSpec("right", path).build()
