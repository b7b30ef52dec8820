"""The paper's learned scheduler: a Q-table over histories of tasks."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler


class QTable(Scheduler):
  """Boltzmann choice over Q(history, task), learned by moving averages.

  Equation 12 of the paper; its hyper-parameter table gives the defaults.
  """

  def __init__(
    self,
    tasks: int,
    generator: np.random.Generator,
    phi: float = 0.6,
    temperature: float = 360.0,
    decay: float = 0.9995,
    minimum: float = 0.1,
  ):
    """Starts with an empty table; see `config.QTableConfig`."""
    super().__init__(generator)
    self._tasks = tasks
    self._phi = phi
    self._decay = decay
    self._minimum = minimum
    self.temperature = temperature
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
    """Chooses a task, then cools down."""
    task = int(self._generator.choice(self._tasks, p=self.probabilities()))
    self._history = (*self._history, task)
    self.temperature = max(self.temperature * self._decay, self._minimum)
    return task

  def end_episode(self, main_returns: Sequence[float]) -> None:
    """Moves Q of every prefix of the history towards its return.

    Args:
      main_returns: G_h for each choice h of the episode.

    Raises:
      ValueError: there is not one return for each choice.
    """
    if len(main_returns) != len(self._history):
      raise ValueError(
        f"{len(main_returns)} returns for {len(self._history)} choices"
      )
    for period, main_return in enumerate(main_returns):
      prefix = self._history[: period + 1]
      old = self._table.get(prefix, 0.0)
      self._table[prefix] = (1 - self._phi) * old + self._phi * float(
        main_return
      )

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
    self._table = {
      tuple(int(task) for task in history if task >= 0): float(value)
      for history, value in zip(
        state["histories"], state["values"], strict=True
      )
    }
    self.temperature = float(state["temperature"])
    self._history = ()
