"""A point that walks to a goal: the smallest environment of our contract.

Two tasks with the observables and calls of the nine block tasks, in
microseconds: for tests, and as an example of `config.environment`.
"""

import dm_env
import numpy as np
from dm_env import specs

from lfgp_dmc import seeding

TASKS = ("right", "left")
_EPISODE_STEPS = 20
_SPEED = 0.2  # m a step at |a| = 1
_GOAL = 0.8  # m from the middle
_TOLERANCE = 0.2  # m


class PointEnvironment(dm_env.Environment):
  """Task "right" is done within 0.2 m of x = 0.8 m, "left" of x = -0.8 m."""

  def __init__(self, seed: int = 0, fail_every: int = 0):
    """Makes the environment, whose starts the seed fixes.

    Each `fail_every` episodes the physics "fails" half way: LAST with discount
    0, as Composer does.
    """
    self._random = seeding.generator(seed, "toy")
    self._fail_every = fail_every
    self._episodes = 0
    self._steps = _EPISODE_STEPS
    self._position = np.zeros(2)
    self._done = dict.fromkeys(TASKS, False)

  def reseed(self, seed: int) -> None:
    """The next reset depends on this seed alone."""
    self._random = seeding.generator(seed, "toy")

  def reset(self) -> dm_env.TimeStep:
    """Starts anywhere within 0.3 m of the middle."""
    self._steps = 0
    self._episodes += 1
    self._position = self._random.uniform(-0.3, 0.3, 2)
    self._done = dict.fromkeys(TASKS, False)
    return dm_env.restart(self._observe())

  def step(self, action: np.ndarray) -> dm_env.TimeStep:
    """Moves by the action, float [2] in [-1, 1]."""
    if self._steps >= _EPISODE_STEPS:
      return self.reset()
    self._steps += 1
    step = _SPEED * np.clip(action, -1, 1)
    self._position = np.clip(self._position + step, -1, 1)
    observation = self._observe()
    reward = float(observation["reward/right"])
    fails = self._fail_every and self._episodes % self._fail_every == 0
    if fails and self._steps == _EPISODE_STEPS // 2:
      self._steps = _EPISODE_STEPS
      return dm_env.termination(reward, observation)
    if self._steps == _EPISODE_STEPS:
      return dm_env.truncation(reward, observation)
    return dm_env.transition(reward, observation)

  def action_spec(self) -> specs.BoundedArray:
    """Two floats in [-1, 1]."""
    return specs.BoundedArray((2,), np.float32, -1.0, 1.0, name="action")

  def observation_spec(self) -> dict[str, specs.Array]:
    """The position, and each task's success and reward."""
    spec: dict[str, specs.Array] = {"position": specs.Array((2,), np.float32)}
    for task in TASKS:
      spec[f"success/{task}"] = specs.Array((), np.bool_)
      spec[f"reward/{task}"] = specs.Array((), np.float32)
    return spec

  def _observe(self) -> dict[str, np.ndarray]:
    observation = {"position": self._position.astype(np.float32)}
    for task, side in zip(TASKS, (1, -1), strict=True):
      distance = abs(self._position[0] - side * _GOAL)
      self._done[task] |= bool(distance < _TOLERANCE)
      observation[f"success/{task}"] = np.asarray(self._done[task])
      observation[f"reward/{task}"] = np.asarray(1 - distance, np.float32)
    return observation


class WalkingActor:
  """Walks to the goal of its task, with a little noise."""

  def begin(self, task: str, seed: int) -> None:
    """Starts an attempt at `task`."""
    self._side = 1.0 if task == "right" else -1.0
    self._random = seeding.generator(seed)

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Maps float32 [2] to an action, float32 [2]."""
    action = np.array([self._side, 0]) + self._random.normal(0, 0.1, 2)
    return np.clip(action, -1, 1).astype(np.float32)
