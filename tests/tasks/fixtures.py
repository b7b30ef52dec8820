"""Environments and poses that the tests of tasks share."""

import functools

import numpy as np

from lfgp_dmc import tasks
from lfgp_dmc.tasks import workspace as ws

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
KEEP = np.zeros(4)  # the action that moves nothing


@functools.cache
def environment(task: str = "stack", **options):
  """One environment for all tests, in whatever state the last one left it."""
  return tasks.load(task, seed=0, **options)


def fresh(task: str = "stack", **options):
  """The same, as if it were newly made with seed 0."""
  made = environment(task, **options)
  made.reseed(0)
  return made


def pose(x: float = 0.0, y: float = 0.5, z: float = ws.FLAT_Z, quat=UPRIGHT):
  """A block's pose, by default upright and flat in the tray's middle."""
  return np.array([x, y, z, *quat])


def repeat(env, action, steps: int):
  """The last timestep of several with the same action."""
  for _ in range(steps):
    timestep = env.step(action)
  return timestep
