"""How any dm_env environment is read: flat observations, widths, rewards.

Our nine tasks are laid out in the order of `observations.py`, every other
environment's floating-point observables in the order of its specification. What
belongs to tasks (`success/`, `condition/`, `reward/`) is never an input.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import dm_env
import numpy as np

from lfgp_dmc import observations

TASK_PREFIXES = (
  observations.SUCCESS_PREFIX,
  observations.CONDITION_PREFIX,
  observations.REWARD_PREFIX,
)

Flattener = Callable[[Any], np.ndarray]


def flattener(environment: dm_env.Environment) -> Flattener:
  """The function from this environment's observation to float32 [O].

  Raises:
    ValueError: the environment has no floating-point observable.
  """
  spec = environment.observation_spec()
  if not isinstance(spec, Mapping):
    return lambda observation: np.asarray(observation, np.float32).ravel()
  if observations.OBSERVATION_SLICES.keys() <= spec.keys():
    return observations.flatten
  names = [
    name
    for name, part in spec.items()
    if not name.startswith(TASK_PREFIXES)
    and np.issubdtype(part.dtype, np.floating)
  ]
  if not names:
    raise ValueError(
      "no floating-point observable to learn from; the environment offers: "
      f"{', '.join(spec)}"
    )

  def flatten(observation: Mapping[str, Any]) -> np.ndarray:
    parts = [np.ravel(observation[name]) for name in names]
    return np.concatenate(parts, dtype=np.float32)

  return flatten


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
  """The sizes (O, A) of flat observations and of actions."""
  spec: Any = environment.observation_spec()
  if isinstance(spec, Mapping):
    example: Any = {name: np.zeros(part.shape) for name, part in spec.items()}
  else:
    example = np.zeros(spec.shape)
  action_size = int(np.prod(environment.action_spec().shape))
  return len(flattener(environment)(example)), action_size


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
