"""Schedulers by name."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from lfgp_dmc.agents.schedulers.base import Scheduler
from lfgp_dmc.agents.schedulers.conditional import (
  ConditionalWeighted,
  table_for,
)
from lfgp_dmc.agents.schedulers.handcrafted import (
  WeightedRandomHandcrafted,
  sequences_for,
)
from lfgp_dmc.agents.schedulers.q_table import QTable
from lfgp_dmc.agents.schedulers.weighted_random import (
  WeightedRandom,
  main_weights,
)

NAMES = (
  "q_table",  # learned (the paper's LfGP)
  "weighted_random",  # the main task with `main_weight`, the rest equal
  "weighted_random_handcrafted",  # the same, mixed with fixed sequences
  "conditional_weighted",  # next given last (the paper's SAC-X experts)
  "main_only",  # LfGP-NS, and single-task methods
  "uniform",
)


class SchedulerConfig(Protocol):
  """The fields of an agent's config that `make_scheduler` reads."""

  @property
  def scheduler(self) -> str:
    """One of `NAMES`."""

  @property
  def scheduler_phi(self) -> float:
    """Q-table: weight of a new return, 0..1."""

  @property
  def scheduler_temperature(self) -> float:
    """Q-table: first temperature."""

  @property
  def scheduler_decay(self) -> float:
    """Q-table: factor on the temperature at every choice."""

  @property
  def scheduler_minimum(self) -> float:
    """Q-table: lowest temperature."""

  @property
  def main_weight(self) -> float:
    """Weighted random: probability of the main task."""

  @property
  def handcrafted_probability(self) -> float:
    """Probability that an episode follows a handcrafted sequence."""


def make_scheduler(
  config: SchedulerConfig,
  tasks: Sequence[str],
  main_index: int,
  periods: int,
  generator: np.random.Generator,
) -> Scheduler:
  """Builds the scheduler that `config.scheduler` names.

  Args:
    config: see `SchedulerConfig`.
    tasks: names of the K tasks.
    main_index: the main task's place.
    periods: H, choices an episode.
    generator: source of all choices.

  Returns:
    A new scheduler.

  Raises:
    ValueError: the name is unknown, or the scheduler does not fit the tasks.
  """
  if periods < 1:
    raise ValueError(f"periods is {periods}; valid: 1 or more")
  count = len(tasks)
  weights = main_weights(count, main_index, config.main_weight)
  match config.scheduler:
    case "q_table":
      return QTable(
        count,
        generator,
        config.scheduler_phi,
        config.scheduler_temperature,
        config.scheduler_decay,
        config.scheduler_minimum,
      )
    case "weighted_random":
      return WeightedRandom(weights, generator)
    case "weighted_random_handcrafted":
      return WeightedRandomHandcrafted(
        weights,
        [
          [sequence[period % len(sequence)] for period in range(periods)]
          for sequence in sequences_for(tasks, main_index)
        ],
        config.handcrafted_probability,
        generator,
      )
    case "conditional_weighted":
      return ConditionalWeighted(table_for(tasks, main_index), generator)
    case "main_only":
      return WeightedRandom(main_weights(count, main_index, 1.0), generator)
    case "uniform":
      return WeightedRandom(np.ones(count), generator)
  raise ValueError(
    f"unknown scheduler {config.scheduler!r}; valid: {', '.join(NAMES)}"
  )
