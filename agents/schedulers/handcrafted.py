"""Weighted random choices, mixed with handcrafted sequences of tasks."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents.schedulers.config import HandcraftedConfig
from lfgp_dmc.agents.schedulers.weighted_random import (
  WeightedRandom,
  main_weights,
)

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
  """The handcrafted sequences, of eight indices each.

  There are two more if `bring` is an auxiliary task.

  Raises:
    ValueError: the set lacks a task that the sequences name.
  """
  names = {name: index for index, name in enumerate(tasks)}
  main = tasks[0]
  has_bring = "bring" in names and main != "bring"
  chosen = SEQUENCES + (INSERT_SEQUENCES if has_bring else ())
  needed = {name for sequence in chosen for name in sequence} - {MAIN}
  missing = sorted(needed - names.keys())
  if missing:
    raise ValueError(
      f"the handcrafted scheduler needs {', '.join(missing)} among the tasks; "
      f"got {', '.join(tasks)}; others have scheduler.kind weighted_random"
    )
  names[MAIN] = 0
  return [tuple(names[name] for name in sequence) for sequence in chosen]


class WeightedRandomHandcrafted(WeightedRandom):
  """At each episode's start: a handcrafted sequence, or weighted random."""

  def __init__(
    self,
    config: HandcraftedConfig,
    tasks: Sequence[str],
    generator: np.random.Generator,
  ):
    """Raises ValueError as `sequences_for`."""
    super().__init__(main_weights(len(tasks), config.main_weight), generator)
    self._sequences = sequences_for(tasks)
    self._probability = config.probability
    self._sequence: tuple[int, ...] = ()
    self._period = 0

  def begin_episode(self) -> None:
    """Chooses the sequence of this episode, or none."""
    self._period, self._sequence = 0, ()
    if self._generator.random() < self._probability:
      chosen = int(self._generator.integers(len(self._sequences)))
      self._sequence = self._sequences[chosen]

  def next_task(self) -> int:
    """The sequence's next task, over again in longer episodes; or random."""
    if not self._sequence:
      return super().next_task()
    task = self._sequence[self._period % len(self._sequence)]
    self._period += 1
    return task
