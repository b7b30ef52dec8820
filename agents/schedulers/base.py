"""What every scheduler does, and the returns that some learn from."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.agents import serialisation


class Scheduler:
  """Chooses a task every xi steps; by default one that learns nothing."""

  def __init__(self, generator: np.random.Generator):
    """Keeps the source of all choices."""
    self._generator = generator

  def begin_episode(self) -> None:
    """Forgets the choices of the last episode."""

  def next_task(self) -> int:
    """Chooses the index of the task of the next xi steps."""
    raise NotImplementedError

  def end_episode(self, main_returns: Sequence[float]) -> None:
    """Learns from the main task's return G_h from each period h to the end.

    Raises:
      ValueError: there is not one return for each choice.
    """

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values, the generator's state among them."""
    return {"generator": serialisation.numpy_generator_state(self._generator)}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    serialisation.load_numpy_generator_state(
      self._generator, state["generator"]
    )


def period_returns(
  reward: np.ndarray, period: int, discount: float
) -> np.ndarray:
  """The discounted return from each period's start to the episode's end.

  G_h = sum over t >= h xi of gamma^(t - h xi) r_t: the discount restarts at
  the period (the paper's G(T^(h:H)) as the released code computes it).

  Args:
    reward: [T], the main task's reward of each step.
    period: xi, steps a choice.
    discount: gamma, a step.

  Returns:
    float64 [ceil(T / xi)].
  """
  returns = np.empty(len(reward), np.float64)
  total = 0.0
  for step in range(len(reward) - 1, -1, -1):
    total = float(reward[step]) + discount * total
    returns[step] = total
  return returns[::period]
