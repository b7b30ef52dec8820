"""The one loop that plays an environment."""

from collections.abc import Callable, Iterator

import dm_env
import numpy as np

from lfgp_dmc import finite
from lfgp_dmc.acting import environments
from lfgp_dmc.types import Step, Transition

_WHERE = "the environment's observation at step {} of its episode"


def steps(
  environment: dm_env.Environment,
  first: dm_env.TimeStep,
  choose_action: Callable[[np.ndarray], np.ndarray],
) -> Iterator[Step]:
  """Plays from a time step to the episode's end.

  Lazy: an action is chosen when its step is requested, after whatever the
  caller did with the step before.

  Args:
    environment: to play in.
    first: where it is now, such as the time step of its reset.
    choose_action: observation, float32 [O] -> action, float32 [A].

  Raises:
    NotFiniteError: the environment observed NaN or infinity, other than in a
      physics failure.
  """
  flatten = environments.flattener(environment)
  timestep, observation, number = first, flatten(first.observation), 0
  if not finite.is_finite(observation):
    raise finite.fault(_WHERE.format(number), first.observation)
  while not timestep.last():
    action = choose_action(observation)
    timestep = environment.step(action)
    number += 1
    reached = flatten(timestep.observation)
    failed = environments.is_physics_failure(timestep)
    if not failed and not finite.is_finite(reached):
      raise finite.fault(_WHERE.format(number), timestep.observation)
    yield Step(Transition(observation, action, reached), timestep)
    observation = reached
