"""Schedulers choose the intention that acts for the next xi steps."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents.schedulers import config as configs
from lfgp_dmc.agents.schedulers.base import Scheduler, period_returns
from lfgp_dmc.agents.schedulers.conditional import ConditionalWeighted
from lfgp_dmc.agents.schedulers.handcrafted import WeightedRandomHandcrafted
from lfgp_dmc.agents.schedulers.q_table import QTable
from lfgp_dmc.agents.schedulers.weighted_random import (
  WeightedRandom,
  main_weights,
)

__all__ = ["Scheduler", "make_scheduler", "period_returns"]


def make_scheduler(
  config: configs.SchedulerConfig,
  tasks: Sequence[str],
  generator: np.random.Generator,
) -> Scheduler:
  """Builds a config's scheduler, which draws all choices from `generator`.

  Raises:
    ValueError: the scheduler does not fit the tasks.
  """
  count = len(tasks)
  match config:
    case configs.QTableConfig():
      return QTable(count, generator, config)
    case configs.WeightedRandomConfig():
      return WeightedRandom(main_weights(count, config.main_weight), generator)
    case configs.HandcraftedConfig():
      return WeightedRandomHandcrafted(config, tasks, generator)
    case configs.ConditionalConfig():
      return ConditionalWeighted(tasks, generator)
    case configs.MainOnlyConfig():
      return WeightedRandom(main_weights(count, 1.0), generator)
    case configs.UniformConfig():
      return WeightedRandom(np.ones(count), generator)
