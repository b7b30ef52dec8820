"""The paper's learned scheduler: a Q-table over histories of tasks."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler
from lfgp_dmc.agents.schedulers.config import QTableConfig

_UNKNOWN = -1  # the number of histories that never were


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
    # Histories are numbered: 0 is empty, and each is an earlier one (their
    # number, the task chosen next) and has the Q of its last choice. So the
    # table grows by the new choices alone, not by whole histories.
    self._numbers: dict[tuple[int, int], int] = {}
    self._values = [0.0]
    self._history: list[int] = []

  def value(self, choices: Sequence[int]) -> float:
    """Q of the last of `choices` after the ones before it; at first 0."""
    return self._value(self._number(choices))

  def begin_episode(self) -> None:
    """Empties the history."""
    self._history = []

  def probabilities(self) -> np.ndarray:
    """softmax(Q(history, .) / temperature), float64 [K]."""
    number = self._number(self._history)
    longer = (self._longer(number, task) for task in range(self._tasks))
    values = np.array([self._value(each) for each in longer])
    weights = np.exp((values - values.max()) / self.temperature)
    return weights / weights.sum()

  def next_task(self) -> int:
    """Draws a task, then cools down."""
    task = super().next_task()
    self._history.append(task)
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
    phi, number = self._config.phi, 0
    for task, main_return in zip(self._history, main_returns, strict=True):
      longer = self._numbers.setdefault((number, task), len(self._values))
      if longer == len(self._values):
        self._values.append(0.0)
      number = longer
      self._values[number] *= 1 - phi
      self._values[number] += phi * main_return

  def state_dict(self) -> dict[str, Any]:
    """Rows of the table: int64 [n, 2] and their Q [n]; the temperature."""
    return super().state_dict() | {
      "choices": np.array([*self._numbers], np.int64).reshape(-1, 2),
      "values": np.array(self._values[1:], np.float64),
      "temperature": float(self.temperature),
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    super().load_state_dict(state)
    known = state["choices"].tolist()
    self._numbers = {tuple(row): n for n, row in enumerate(known, 1)}
    self._values = [0.0, *state["values"].tolist()]
    self.temperature = float(state["temperature"])
    self._history = []

  def _number(self, choices: Sequence[int]) -> int:
    """Of a history."""
    number = 0
    for task in choices:
      number = self._longer(number, task)
    return number

  def _longer(self, number: int, task: int) -> int:
    """The number of a history and one more choice."""
    return self._numbers.get((number, task), _UNKNOWN)

  def _value(self, number: int) -> float:
    return 0.0 if number == _UNKNOWN else self._values[number]
