"""Fixed weights, each choice independent of the others."""

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler


class WeightedRandom(Scheduler):
  """Draws every choice from one distribution."""

  def __init__(self, weights: np.ndarray, generator: np.random.Generator):
    """Normalises the weights, float64 [K]."""
    super().__init__(generator)
    self._probabilities = weights / weights.sum()

  def probabilities(self) -> np.ndarray:
    """The distribution, float64 [K]."""
    return self._probabilities


def main_weights(tasks: int, weight: float) -> np.ndarray:
  """The first task's probability, the rest shared equally; float64 [K]."""
  if tasks == 1:
    return np.ones(1)
  weights = np.full(tasks, (1 - weight) / (tasks - 1))
  weights[0] = weight
  return weights
