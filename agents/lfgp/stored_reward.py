"""Dense rewards that the replay stores: SAC-X."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents.batches import Batch
from lfgp_dmc.agents.lfgp.config import StoredReward
from lfgp_dmc.agents.lfgp.reward_source import LabelledBatch, RewardSource
from lfgp_dmc.agents.rewards import bounded
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.types import Episode


class StoredRewards(RewardSource):
  """Takes what each batch brings along."""

  def __init__(self, config: StoredReward, main_column: int):
    """Keeps the settings.

    Args:
      config: clip and scale.
      main_column: the main task's place among the replay's `reward_tasks`.
    """
    super().__init__()
    self._config, self._main_column = config, main_column

  def label(self, batch: Batch) -> LabelledBatch:
    """Clips and scales the stored rewards."""
    assert batch.stored_reward is not None, "the replay keeps rewards"
    reward = bounded(batch.stored_reward, self._config.clip, self._config.scale)
    return LabelledBatch(batch.inputs, batch.action, batch.next_inputs, reward)

  def main_rewards(self, episode: Episode) -> np.ndarray:
    """As they are stored, float [T]."""
    assert episode.rewards is not None, "the loop keeps rewards"
    return episode.rewards[:, self._main_column]


def reward_columns(replay: Replay, tasks: Sequence[str]) -> list[int]:
  """Where the replay keeps the rewards of `tasks`.

  Raises:
    ValueError: it lacks some of them; the message names them.
  """
  missing = [task for task in tasks if task not in replay.reward_tasks]
  if missing:
    raise ValueError(
      f"the replay keeps no rewards of {', '.join(missing)}; it keeps: "
      f"{', '.join(replay.reward_tasks) or 'none'}"
    )
  return [replay.reward_tasks.index(task) for task in tasks]
