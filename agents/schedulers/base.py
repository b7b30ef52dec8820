"""What every scheduler does, and the returns that some learn from."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


class Scheduler:
  """Chooses a task every xi steps; by default one that learns nothing."""

  def __init__(self, generator: np.random.Generator):
    self._generator = generator

  def begin_episode(self) -> None:
    """Forgets the choices of the last episode."""

  def probabilities(self) -> np.ndarray:
    """Those of the next choice, float64 [K]."""
    raise NotImplementedError

  def next_task(self) -> int:
    """Draws the index of the task of the next xi steps."""
    weights = self.probabilities()
    return int(self._generator.choice(len(weights), p=weights))

  def end_episode(self, main_returns: Sequence[float]) -> None:
    """Learns from the main task's return G_h from each period h to the end.

    Raises:
      ValueError: there is not one return for each choice.
    """

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values, the generator's state among them."""
    return {"generator": self._generator.bit_generator.state}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self._generator.bit_generator.state = state["generator"]


def period_returns(
  reward: np.ndarray, period: int, discount: float
) -> np.ndarray:
  """The return from each of ceil(T / xi) periods' start to the episode's end.

  G_h = sum over t >= h xi of gamma^(t - h xi) r_t: the discount restarts at
  the period (the paper's G(T^(h:H)) as the released code computes it). The
  period is xi steps; rewards are the main task's, [T].
  """
  returns = np.empty(len(reward), np.float64)
  total = 0.0
  for step in range(len(reward) - 1, -1, -1):
    total = float(reward[step]) + discount * total
    returns[step] = total
  return returns[::period]
