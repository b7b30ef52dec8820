"""Schedulers by their settings."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents.schedulers import config as configs
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


def make_scheduler(
  config: configs.SchedulerConfig,
  tasks: Sequence[str],
  generator: np.random.Generator,
) -> Scheduler:
  """Builds the scheduler of a config.

  Args:
    config: its class chooses the scheduler.
    tasks: names of the K tasks, the main task first.
    generator: source of all choices.

  Raises:
    ValueError: the scheduler does not fit the tasks.
  """
  count = len(tasks)
  match config:
    case configs.QTableConfig():
      return QTable(
        count,
        generator,
        config.phi,
        config.temperature,
        config.decay,
        config.minimum,
      )
    case configs.WeightedRandomConfig():
      return WeightedRandom(main_weights(count, config.main_weight), generator)
    case configs.HandcraftedConfig():
      return WeightedRandomHandcrafted(
        main_weights(count, config.main_weight),
        sequences_for(tasks),
        config.probability,
        generator,
      )
    case configs.ConditionalConfig():
      return ConditionalWeighted(table_for(tasks), generator)
    case configs.MainOnlyConfig():
      return WeightedRandom(main_weights(count, 1.0), generator)
    case configs.UniformConfig():
      return WeightedRandom(np.ones(count), generator)
