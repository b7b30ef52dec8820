"""The observables of the play task, by name: filled once a step, then read."""

import functools
import operator
from collections.abc import Callable, Iterable

import numpy as np
from dm_control.composer.observation import observable

from lfgp_dmc.acting.environments import REWARD_PREFIX
from lfgp_dmc.observations import (
  CONDITION_PREFIX,
  OBSERVATION_SLICES,
  SUCCESS_PREFIX,
  components,
)
from lfgp_dmc.tasks.arena import FRONT_CAMERA, PlayArena
from lfgp_dmc.tasks.goals import GOALS

_CAMERA = "camera/" + FRONT_CAMERA
_FLAG_NAMES = [p + n for p in (SUCCESS_PREFIX, CONDITION_PREFIX) for n in GOALS]
_FLAGS = (np.array(False), np.array(True))
for _flag in _FLAGS:
  _flag.flags.writeable = False  # handed out as they are


class _Published(observable.Generic):
  """Shows one entry of a dictionary."""

  def __init__(self, published: dict[str, np.ndarray], name: str):
    self._read = functools.partial(operator.getitem, published, name)
    super().__init__(lambda physics: self._read())

  def _callable(self, physics):
    return self._read  # no Python between a caller and the entry


class TaskObservables:
  """The eleven components, successes, conditions, rewards and the camera.

  Attributes:
    by_name: the observables; those that were not chosen are disabled.
  """

  def __init__(
    self,
    arena: PlayArena,
    read_reward: Callable[..., np.ndarray],
    has_camera: bool,
    show_rewards: bool,
  ):
    """Makes them.

    Args:
      arena: has the camera.
      read_reward: (task, physics) -> its dense reward, float [].
      has_camera: whether the camera is observed in place of privileged parts.
      show_rewards: whether every goal's dense reward is observed.
    """
    self._published: dict[str, np.ndarray] = {}
    made: dict[str, observable.Observable] = {}
    for name in (*OBSERVATION_SLICES, *_FLAG_NAMES):
      made[name] = _Published(self._published, name)
      made[name].enabled = True
    for name, component in OBSERVATION_SLICES.items():
      made[name].enabled = not (has_camera and component.privileged)
    for name in GOALS:
      reward = observable.Generic(functools.partial(read_reward, name))
      reward.enabled = show_rewards
      made[REWARD_PREFIX + name] = reward
    camera = arena.mjcf_model.find("camera", FRONT_CAMERA)
    made[_CAMERA] = observable.MJCFCamera(camera, height=84, width=84)
    made[_CAMERA].enabled = has_camera
    self.by_name = made

  def publish_features(self, features: np.ndarray) -> None:
    """Takes the 59 floats, float32 [59], for each component to show its own."""
    self._published.update(components(features))

  def publish_flags(
    self, successes: Iterable[bool], conditions: Iterable[bool]
  ) -> None:
    """Takes one of each a goal, in the order of the goals."""
    flags = map(_FLAGS.__getitem__, (*successes, *conditions))
    self._published.update(zip(_FLAG_NAMES, flags, strict=True))
