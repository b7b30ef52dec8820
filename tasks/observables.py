"""The observables of the play task: read from what it publishes once a step."""

import functools
from collections.abc import Callable, Iterable, Mapping

import numpy as np
from dm_control.composer.observation import observable

from lfgp_dmc.observations import (
  CAMERA_PREFIX,
  CONDITION_PREFIX,
  OBSERVATION_SLICES,
  REWARD_PREFIX,
  SUCCESS_PREFIX,
)
from lfgp_dmc.tasks.cameras import Cameras
from lfgp_dmc.tasks.goals import GOALS

_FLAGS = [p + n for p in (SUCCESS_PREFIX, CONDITION_PREFIX) for n in GOALS]
_VALUES = (np.array(False), np.array(True))
for _value in _VALUES:
  _value.setflags(write=False)  # handed out without a copy


def make(
  published: Mapping[str, np.ndarray],
  read_reward: Callable[..., np.ndarray],
  cameras: Cameras,
  shown: str,
  show_rewards: bool,
) -> dict[str, observable.Observable]:
  """Makes all observables; those that were not chosen are disabled.

  Components and flags come from `published`, dense rewards from
  `read_reward(task, physics)`. With `shown` "vision", frames take the place of
  privileged parts; with "all" they come beside them.
  """
  made: dict[str, observable.Observable] = {}

  def add(name: str, value: observable.Observable, is_enabled: bool) -> None:
    value.enabled = is_enabled
    made[name] = value

  for name, component in OBSERVATION_SLICES.items():
    is_hidden = shown == "vision" and component.privileged
    add(name, _Published(published, name), not is_hidden)
  for name in _FLAGS:
    add(name, _Published(published, name), True)
  for name in GOALS:
    reward = observable.Generic(functools.partial(read_reward, name))
    add(REWARD_PREFIX + name, reward, show_rewards)
  for name in cameras.names:
    frames = observable.Generic(functools.partial(cameras.frame, name))
    add(CAMERA_PREFIX + name, frames, shown != "features")
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
