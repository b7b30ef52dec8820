"""Environments with other actions or observations than their own."""

from collections.abc import Callable
from typing import Any

import dm_env
import numpy as np
from dm_env import specs

from lfgp_dmc.acting import environments
from lfgp_dmc.observations import is_frame

_FEATURES = "encoded frames"


def with_unit_actions(environment: dm_env.Environment) -> dm_env.Environment:
  """The environment, with actions as agents choose them: [A] in [-1, 1].

  They are reshaped and scaled linearly to its own action spec. Raises
  ValueError if that is not of floats with finite bounds.
  """
  spec: Any = environment.action_spec()
  if (
    not isinstance(spec, specs.BoundedArray)
    or not np.issubdtype(spec.dtype, np.floating)
    or not np.isfinite(spec.maximum - spec.minimum).all()
  ):
    raise ValueError(f"actions are {spec}; valid: floats with finite bounds")
  is_unit = np.all(spec.minimum == -1) and np.all(spec.maximum == 1)
  if is_unit and len(spec.shape) == 1:
    return environment
  return _UnitActions(environment, spec)


class _Wrapped:
  """An environment of which some is another's; all else is its own."""

  def __init__(self, environment: Any):
    self._environment = environment

  def __getattr__(self, name: str) -> Any:
    if name.startswith("__"):
      raise AttributeError(name)
    return getattr(self._environment, name)


class _UnitActions(_Wrapped):
  """Its actions are rescaled."""

  def __init__(self, environment: Any, spec: specs.BoundedArray):
    super().__init__(environment)
    self._spec = spec

  def action_spec(self) -> specs.BoundedArray:
    """[A] in [-1, 1]."""
    size = int(np.prod(self._spec.shape))
    return specs.BoundedArray((size,), np.float32, -1.0, 1.0, "action")

  def step(self, action: np.ndarray) -> dm_env.TimeStep:
    """A step by an action in [-1, 1]^A."""
    low, high = self._spec.minimum, self._spec.maximum
    share = (np.clip(np.reshape(action, self._spec.shape), -1, 1) + 1) / 2
    scaled = (1 - share) * low + share * high
    return self._environment.step(scaled.astype(self._spec.dtype))


def with_features(
  environment: dm_env.Environment, encode: Callable[[np.ndarray], np.ndarray]
) -> dm_env.Environment:
  """The environment, with one observable of features in the place of frames.

  `encode` maps frames uint8 [N, C, H, W, 3] to float32 [N, F].
  """
  made: Any = _Features(environment, encode)
  return made


class _Features(_Wrapped):
  """Its frames are encoded."""

  def __init__(self, environment: Any, encode):
    super().__init__(environment)
    self._encode = encode
    self._names = list(filter(is_frame, environment.observation_spec()))
    frames = np.zeros((1, *environments.frame_shape(environment)), np.uint8)
    self._shape = encode(frames)[0].shape

  def observation_spec(self) -> dict[str, specs.Array]:
    """The environment's own, with the frames' features instead of them."""
    spec = self._environment.observation_spec()
    kept = {name: part for name, part in spec.items() if not is_frame(name)}
    return {**kept, _FEATURES: specs.Array(self._shape, np.float32, _FEATURES)}

  def reset(self) -> dm_env.TimeStep:
    """Starts an episode."""
    return self._encoded(self._environment.reset())

  def step(self, action: np.ndarray) -> dm_env.TimeStep:
    """One step."""
    return self._encoded(self._environment.step(action))

  def _encoded(self, timestep: dm_env.TimeStep) -> dm_env.TimeStep:
    seen = timestep.observation
    kept = {name: value for name, value in seen.items() if not is_frame(name)}
    frames = np.stack([seen[name] for name in self._names])
    kept[_FEATURES] = self._encode(frames[None])[0]
    return timestep._replace(observation=kept)
