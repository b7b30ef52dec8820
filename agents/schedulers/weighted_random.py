"""Fixed weights, each choice independent of the others."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler


class WeightedRandom(Scheduler):
  """Draws every choice from one distribution."""

  def __init__(
    self, weights: Sequence[float] | np.ndarray, generator: np.random.Generator
  ):
    """Normalises the weights, [K], 0 or more, not all 0."""
    super().__init__(generator)
    self._probabilities = np.asarray(weights, np.float64)
    self._probabilities = self._probabilities / self._probabilities.sum()

  def probabilities(self) -> np.ndarray:
    """The distribution, float64 [K]."""
    return self._probabilities

  def next_task(self) -> int:
    """Chooses a task."""
    return int(
      self._generator.choice(len(self._probabilities), p=self._probabilities)
    )


def main_weights(tasks: int, weight: float) -> np.ndarray:
  """The first task's weight, the rest shared equally; float64 [K].

  Args:
    tasks: K.
    weight: probability of the main task, 0..1; 1 if it is the only task.
  """
  if tasks == 1:
    return np.ones(1)
  weights = np.full(tasks, (1 - weight) / (tasks - 1))
  weights[0] = weight
  return weights
