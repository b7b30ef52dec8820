"""The one loop that plays an environment."""

from collections.abc import Callable, Iterator

import dm_env
import numpy as np

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
  """
  flatten = environments.flattener(environment)
  timestep, observation = first, flatten(first.observation)
  while not timestep.last():
    action = choose_action(observation)
    timestep = environment.step(action)
    reached = flatten(timestep.observation)
    yield Step(Transition(observation, action, reached), timestep)
    observation = reached
