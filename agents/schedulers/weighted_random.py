"""Fixed weights, each choice independent of the others."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.agents import serialisation


class WeightedRandom:
  """Draws every choice from one distribution."""

  def __init__(
    self, weights: Sequence[float] | np.ndarray, generator: np.random.Generator
  ):
    """Normalises the weights.

    Args:
      weights: [K], 0 or more, not all 0.
      generator: source of the choices.
    """
    self._probabilities = np.asarray(weights, np.float64)
    self._probabilities = self._probabilities / self._probabilities.sum()
    self._generator = generator

  def begin_episode(self) -> None:
    """Nothing to forget."""

  def probabilities(self) -> np.ndarray:
    """The distribution, float64 [K]."""
    return self._probabilities

  def next_task(self) -> int:
    """Chooses a task."""
    return int(
      self._generator.choice(len(self._probabilities), p=self._probabilities)
    )

  def end_episode(self, main_returns: Sequence[float]) -> None:
    """Learns nothing."""

  def state_dict(self) -> dict[str, Any]:
    """The generator's state."""
    return {"generator": serialisation.numpy_generator_state(self._generator)}

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    serialisation.load_numpy_generator_state(
      self._generator, state["generator"]
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
