"""Weighted random choices, mixed with handcrafted sequences of tasks."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.schedulers.weighted_random import WeightedRandom

MAIN = "main"  # stands for the main task, whichever it is

_MOVE = ("reach", "lift", "move_object")
_BRING = ("reach", "lift", "bring")

# The released code's sequences of its eight periods, by name.
SEQUENCES: tuple[tuple[str, ...], ...] = (
  ("reach", "lift", MAIN, "open_gripper") * 2,
  (*_MOVE, MAIN, "open_gripper", *_MOVE),
  ("lift", MAIN, "open_gripper") * 2 + ("lift", MAIN),
  (MAIN, "open_gripper") * 4,
  ("move_object", MAIN, "open_gripper") * 2 + ("move_object", MAIN),
)
INSERT_SEQUENCES: tuple[tuple[str, ...], ...] = (
  ("bring", MAIN, "open_gripper") * 2 + ("bring", MAIN),
  (*_BRING, MAIN, "open_gripper", *_BRING),
)


def sequences_for(tasks: Sequence[str]) -> list[tuple[int, ...]]:
  """The handcrafted sequences of a task set, as indices.

  Args:
    tasks: names of the K tasks, the main task first.

  Returns:
    Sequences of eight indices; two more if `bring` is an auxiliary task.

  Raises:
    ValueError: the set lacks a task that the sequences name.
  """
  names = {name: index for index, name in enumerate(tasks)}
  main = tasks[0]
  has_bring = "bring" in names and main != "bring"
  wanted = SEQUENCES + (INSERT_SEQUENCES if has_bring else ())
  needed = {name for sequence in wanted for name in sequence} - {MAIN}
  missing = sorted(needed - names.keys())
  if missing:
    raise ValueError(
      f"the handcrafted scheduler needs {', '.join(missing)} among the tasks; "
      f"got {', '.join(tasks)}"
    )
  names[MAIN] = 0
  return [tuple(names[name] for name in sequence) for sequence in wanted]


class WeightedRandomHandcrafted:
  """At each episode's start: a handcrafted sequence, or weighted random."""

  def __init__(
    self,
    weights: Sequence[float] | np.ndarray,
    sequences: Sequence[Sequence[int]],
    probability: float,
    generator: np.random.Generator,
  ):
    """Keeps the sequences.

    Args:
      weights: [K], for episodes without a sequence.
      sequences: indices of tasks; one shorter than an episode starts over.
      probability: of a sequence, 0..1; they are equally likely.
      generator: source of the choices.
    """
    self._random = WeightedRandom(weights, generator)
    self._sequences = [tuple(sequence) for sequence in sequences]
    self._probability = probability
    self._generator = generator
    self._sequence: tuple[int, ...] = ()
    self._period = 0

  def begin_episode(self) -> None:
    """Chooses the sequence of this episode, or none."""
    self._period = 0
    self._sequence = ()
    if self._generator.random() < self._probability:
      chosen = int(self._generator.integers(len(self._sequences)))
      self._sequence = self._sequences[chosen]

  def probabilities(self) -> np.ndarray:
    """float64 [K]; one-hot while a sequence runs."""
    if not self._sequence:
      return self._random.probabilities()
    one_hot = np.zeros(len(self._random.probabilities()))
    one_hot[self._sequence[self._period % len(self._sequence)]] = 1.0
    return one_hot

  def next_task(self) -> int:
    """The sequence's next task, or a random one."""
    if not self._sequence:
      return self._random.next_task()
    task = self._sequence[self._period % len(self._sequence)]
    self._period += 1
    return task

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
