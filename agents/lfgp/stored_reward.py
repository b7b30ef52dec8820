"""Dense rewards that the replay stores: SAC-X."""

import numpy as np

from lfgp_dmc.agents.batches import Batch
from lfgp_dmc.agents.lfgp.config import StoredReward
from lfgp_dmc.agents.lfgp.reward_source import LabelledBatch, RewardSource
from lfgp_dmc.agents.rewards import bounded
from lfgp_dmc.types import Episode


class StoredRewards(RewardSource):
  """Labels rows with their stored rewards."""

  def __init__(self, config: StoredReward, main_column: int):
    """`main_column`: the main task's place among the stored rewards."""
    self._config, self._main_column = config, main_column

  def label(self, batch: Batch) -> LabelledBatch:
    """Clips and scales the stored rewards."""
    assert batch.stored_reward is not None, "the replay keeps rewards"
    reward = bounded(batch.stored_reward, self._config.clip, self._config.scale)
    return LabelledBatch(*batch[:3], reward)

  def main_rewards(self, episode: Episode) -> np.ndarray:
    """As they are stored, float [T]."""
    assert episode.rewards is not None, "the loop keeps rewards"
    return episode.rewards[:, self._main_column]
