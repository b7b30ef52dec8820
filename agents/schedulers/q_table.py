"""The paper's learned scheduler: a Q-table over histories of tasks."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler
from lfgp_dmc.agents.schedulers.config import QTableConfig


class QTable(Scheduler):
  """Boltzmann choice over Q(history, task), learned by moving averages.

  Equation 12 of the paper.
  """

  def __init__(
    self, tasks: int, generator: np.random.Generator, config: QTableConfig
  ):
    """Starts with an empty table for K tasks."""
    super().__init__(generator)
    self._tasks, self._config = tasks, config
    self.temperature = config.temperature
    # History ending in the task chosen -> value; what is missing is 0.
    self._table: dict[tuple[int, ...], float] = {}
    self._history: tuple[int, ...] = ()

  def value(self, choices: Sequence[int]) -> float:
    """Q of the last of `choices` after the ones before it."""
    return self._table.get(tuple(choices), 0.0)

  def begin_episode(self) -> None:
    """Empties the history."""
    self._history = ()

  def probabilities(self) -> np.ndarray:
    """softmax(Q(history, .) / temperature), float64 [K]."""
    values = np.array(
      [self.value((*self._history, task)) for task in range(self._tasks)]
    )
    weights = np.exp((values - values.max()) / self.temperature)
    return weights / weights.sum()

  def next_task(self) -> int:
    """Draws a task, then cools down."""
    task = super().next_task()
    self._history = (*self._history, task)
    cooler = self.temperature * self._config.decay
    self.temperature = max(cooler, self._config.minimum)
    return task

  def end_episode(self, main_returns: Sequence[float]) -> None:
    """Moves Q of every prefix of the history towards its return G_h.

    Raises:
      ValueError: there is not one return for each choice.
    """
    if len(main_returns) != len(self._history):
      raise ValueError(
        f"{len(main_returns)} returns for {len(self._history)} choices"
      )
    phi = self._config.phi
    for period, main_return in enumerate(main_returns):
      prefix = self._history[: period + 1]
      self._table[prefix] = (1 - phi) * self.value(prefix) + phi * main_return

  def state_dict(self) -> dict[str, Any]:
    """Histories int64 [n, longest], padded by -1, values [n], temperature."""
    longest = max(map(len, self._table), default=0)
    histories = np.full((len(self._table), longest), -1, np.int64)
    for row, history in enumerate(self._table):
      histories[row, : len(history)] = history
    return super().state_dict() | {
      "histories": histories,
      "values": np.array(list(self._table.values()), np.float64),
      "temperature": float(self.temperature),
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    super().load_state_dict(state)
    rows = zip(state["histories"], state["values"], strict=True)
    self._table = {
      tuple(int(task) for task in history if task >= 0): float(value)
      for history, value in rows
    }
    self.temperature = float(state["temperature"])
    self._history = ()
