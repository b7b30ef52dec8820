"""The observables of the play task: read from what it publishes once a step."""

import functools
from collections.abc import Callable, Iterable, Mapping

import numpy as np
from dm_control.composer.observation import observable

from lfgp_dmc.observations import (
  CONDITION_PREFIX,
  OBSERVATION_SLICES,
  REWARD_PREFIX,
  SUCCESS_PREFIX,
)
from lfgp_dmc.tasks.arena import FRONT_CAMERA, PlayArena
from lfgp_dmc.tasks.goals import GOALS

_CAMERA = "camera/" + FRONT_CAMERA
_FLAGS = [p + n for p in (SUCCESS_PREFIX, CONDITION_PREFIX) for n in GOALS]
_VALUES = (np.array(False), np.array(True))
for _value in _VALUES:
  _value.setflags(write=False)  # handed out without a copy


def make(
  published: Mapping[str, np.ndarray],
  read_reward: Callable[..., np.ndarray],
  arena: PlayArena,
  has_camera: bool,
  show_rewards: bool,
) -> dict[str, observable.Observable]:
  """Makes all observables; those that were not chosen are disabled.

  Components and flags come from `published`, dense rewards from
  `read_reward(task, physics)`. The camera takes the place of privileged parts.
  """
  made: dict[str, observable.Observable] = {}

  def add(name: str, value: observable.Observable, is_enabled: bool) -> None:
    value.enabled = is_enabled
    made[name] = value

  for name, component in OBSERVATION_SLICES.items():
    is_hidden = has_camera and component.privileged
    add(name, _Published(published, name), not is_hidden)
  for name in _FLAGS:
    add(name, _Published(published, name), True)
  for name in GOALS:
    reward = observable.Generic(functools.partial(read_reward, name))
    add(REWARD_PREFIX + name, reward, show_rewards)
  camera = arena.mjcf_model.find("camera", FRONT_CAMERA)
  pictures = observable.MJCFCamera(camera, height=84, width=84)
  add(_CAMERA, pictures, has_camera)
  return made


class _Published(observable.Generic):
  """Read from what the task publishes, by the fastest call there is."""

  def __init__(self, published: Mapping[str, np.ndarray], name: str):
    super().__init__(lambda physics: published[name])
    self._read = functools.partial(published.__getitem__, name)

  def _callable(self, physics):
    return self._read


def flags(
  successes: Iterable[bool], conditions: Iterable[bool]
) -> dict[str, np.ndarray]:
  """Values of the flags by name; one of each a goal, in their order."""
  values = map(_VALUES.__getitem__, (*successes, *conditions))
  return dict(zip(_FLAGS, values, strict=True))
