"""The one loop that plays an environment."""

from collections.abc import Callable, Iterator

import dm_env
import numpy as np

from lfgp_dmc import finite
from lfgp_dmc.acting import environments
from lfgp_dmc.types import Step, Transition


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
  taken = 0

  def read(timestep: dm_env.TimeStep) -> np.ndarray:
    flat = flatten(timestep.observation)
    if finite.is_finite(flat) or environments.is_physics_failure(timestep):
      return flat
    where = f"the environment's observation at step {taken} of its episode"
    raise finite.fault(where, timestep.observation)

  timestep, observation = first, read(first)
  while not timestep.last():
    action = choose_action(observation)
    timestep = environment.step(action)
    taken += 1
    reached = read(timestep)
    yield Step(Transition(observation, action, reached), timestep)
    observation = reached
