"""Which task acts when: one alone, or play from one to the next."""

from collections.abc import Sequence
from typing import Any

import dm_env

from lfgp_dmc import seeding
from lfgp_dmc.acting import environments
from lfgp_dmc.pictures.recorder import Switch

_PLAY_PATIENCE = 120  # control steps an attempt


def one_task(task: str) -> Switch:
  """The same task at every step."""
  return lambda step, timestep: task


class Play:
  """A random task after each success or 120 steps, without a reset.

  It is another one, if there are several.
  """

  def __init__(self, environment: Any, tasks: Sequence[str], seed: int):
    """Chooses the first task; the environment must have `clear_success`."""
    self._environment, self._tasks = environment, tasks
    self._random = seeding.generator(seed, "play")
    self._task = ""
    self._next(0)

  def __call__(self, step: int, timestep: dm_env.TimeStep) -> str:
    """The task that acts at this control step."""
    is_done = environments.has_succeeded(timestep, self._task)
    if is_done or step - self._since >= _PLAY_PATIENCE:
      self._environment.clear_success()
      self._next(step)
    return self._task

  def _next(self, step: int) -> None:
    others = [task for task in self._tasks if task != self._task]
    others = others or [*self._tasks]  # an auxiliary task stands alone
    self._task = others[self._random.integers(len(others))]
    self._since = step
