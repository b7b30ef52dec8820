"""How any dm_env environment is read and driven: flat rows, widths, rewards.

Our nine tasks are laid out in the order of `observations.py`, every other
environment's floating-point observables in the order of its specification, and
then its frames: `camera/NAME`, uint8 [H, W, 3], of one size. What belongs to
tasks (`success/`, `condition/`, `reward/`) is never an input. Agents act in
[-1, 1]: see `wrappers.with_unit_actions`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import dm_env
import numpy as np
from dm_env import specs

from lfgp_dmc import observations
from lfgp_dmc.observations import is_frame

TASK_PREFIXES = (
  observations.SUCCESS_PREFIX,
  observations.CONDITION_PREFIX,
  observations.REWARD_PREFIX,
)

Flattener = Callable[[Any], np.ndarray]


def flattener(environment: dm_env.Environment) -> Flattener:
  """The function from this environment's observation to float32 [O].

  Raises:
    ValueError: the environment has no floating-point observable, or nests them.
  """
  spec = environment.observation_spec()
  parts = spec.values() if isinstance(spec, Mapping) else [spec]
  if not all(isinstance(part, specs.Array) for part in parts):
    raise ValueError(f"observations are {spec}; valid: an array, or named ones")
  if not isinstance(spec, Mapping):
    # A copy: some environments fill one array again and again.
    return lambda observation: np.array(observation, np.float32).ravel()
  if observations.has_state(spec):
    return observations.flatten
  names = [
    name
    for name, part in spec.items()
    if not name.startswith(TASK_PREFIXES)
    and np.issubdtype(part.dtype, np.floating)
  ]
  names += filter(is_frame, spec)
  if not names:
    raise ValueError(
      "no floating-point observable to learn from; the environment offers: "
      f"{', '.join(spec)}"
    )

  def flatten(observation: Mapping[str, Any]) -> np.ndarray:
    parts = [np.ravel(observation[name]) for name in names]
    return np.concatenate(parts, dtype=np.float32)

  return flatten


def frame_shape(environment: dm_env.Environment) -> tuple[int, ...]:
  """[C, H, W, 3] of the frames that are learned from; empty without.

  Beside all eleven components of the block tasks, frames are not.

  Raises:
    ValueError: frames are not uint8 [H, W, 3], or of several sizes.
  """
  spec: Any = environment.observation_spec()
  if not isinstance(spec, Mapping) or observations.has_state(spec):
    return ()
  found = [spec[name] for name in filter(is_frame, spec)]
  kinds = {(part.shape, np.dtype(part.dtype).name) for part in found}
  if not kinds:
    return ()
  (shape, dtype), *others = kinds
  if others or dtype != "uint8" or shape[2:] != (3,):
    raise ValueError(f"frames are {kinds}; valid: uint8 [H, W, 3] of one size")
  return (len(found), *shape)


def reseeded(
  environment: dm_env.Environment,
  make_environment: Callable[..., dm_env.Environment],
  seed: int,
) -> dm_env.Environment:
  """The environment whose next reset depends on `seed` alone.

  It is the same one if it has a `reseed`, or else a new one of `seed=`.
  """
  if hasattr(environment, "reseed"):
    environment.reseed(seed)
    return environment
  environment.close()
  return make_environment(seed=seed)


def widths(environment: dm_env.Environment) -> tuple[int, int]:
  """The sizes (O, A) of flat observations without pixels, and of actions."""
  flatten, spec = flattener(environment), environment.observation_spec()
  if isinstance(spec, Mapping):
    example: Any = {name: np.zeros(part.shape) for name, part in spec.items()}
  else:
    example = np.zeros(spec.shape)
  action_size = int(np.prod(environment.action_spec().shape))
  pixels = frame_shape(environment)
  size = len(flatten(example)) - (math.prod(pixels) if pixels else 0)
  return size, action_size


def task_rewards(timestep: dm_env.TimeStep, tasks: Sequence[str]) -> np.ndarray:
  """Each task's reward of a step that is not an episode's first, float32 [K].

  It is the observable `reward/<task>`, or else the environment's own reward.
  """
  own = 0.0 if timestep.reward is None else float(timestep.reward)
  observed = timestep.observation
  if not isinstance(observed, Mapping):
    observed = {}
  rewards = [
    float(observed.get(observations.REWARD_PREFIX + task, own))
    for task in tasks
  ]
  return np.asarray(rewards, np.float32)


def with_observed_tasks(
  environment: dm_env.Environment, tasks: Sequence[str], prefix: str
) -> tuple[str, ...]:
  """`tasks`, then all others that have an observable with the prefix."""
  spec = environment.observation_spec()
  names = spec if isinstance(spec, Mapping) else ()
  shown = [n.removeprefix(prefix) for n in names if n.startswith(prefix)]
  return tuple(dict.fromkeys((*tasks, *shown)))


def has_succeeded(timestep: dm_env.TimeStep, task: str) -> bool | None:
  """Whether `task` has succeeded; None if it is not observable."""
  observed = timestep.observation
  if not isinstance(observed, Mapping):
    return None
  value = observed.get(observations.SUCCESS_PREFIX + task)
  return None if value is None else bool(np.all(value))


def is_physics_failure(timestep: dm_env.TimeStep) -> bool:
  """Whether the simulation broke: Composer's LAST with discount 0."""
  return bool(timestep.last() and timestep.discount == 0)
