"""Samples the batches of one update."""

import numpy as np
import torch

from lfgp_dmc.agents.batches import Batch, Draw, joined
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp.config import (
  DiscriminatorReward,
  ExampleReward,
  LfgpConfig,
)
from lfgp_dmc.agents.lfgp.device_replay import DeviceReplay
from lfgp_dmc.agents.lfgp.example_reward import example_rows, with_examples
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.data.replay import Replay


class BatchMaker:
  """Draws batches from the replay and from the experts."""

  def __init__(
    self,
    config: LfgpConfig,
    replay: Replay,
    reward_columns: list[int],
    experts: ExpertPool | None,
    standardiser: Standardiser,
    generator: np.random.Generator,
  ):
    """Takes `reward_columns` of the replay's rewards, one a task, or none.

    Raises:
      ValueError: a task has no row of success where such rows are needed.
    """
    self._config, self._rows = config.reward, config.batch_size
    self._replay = replay
    self._columns = reward_columns
    self._experts = experts
    self._standardiser = standardiser
    self.generator = generator
    self._device = standardiser.mean.device
    self._mirror = None
    if self._device.type != "cpu":
      self._mirror = DeviceReplay(replay, self._device)
    reward = self._config
    if isinstance(reward, ExampleReward) or (
      isinstance(reward, DiscriminatorReward) and reward.final_share > 0
    ):
      self._pool.check_finals()

  def draw(self, updates: int) -> Draw:
    """Draws for the update after the first `updates`."""
    match self._config:
      case DiscriminatorReward() as config:
        return self._with_experts(config, updates)
      case ExampleReward() as config:
        rows = example_rows(config, self._rows)
        batch = self._transitions(self._rows - rows)
        return Draw(
          with_examples(batch, self._pool, self.generator, rows, config.noise)
        )
    return Draw(self._transitions(self._rows))

  def _with_experts(self, config: DiscriminatorReward, updates: int) -> Draw:
    share = config.expert_share * config.expert_share_decay**updates
    rows = int(share * self._rows)
    own, policy, expert = self._rows - rows, None, None
    if updates % config.every == 0:  # both sides' rows in one draw
      both = self._transitions(own + self._rows)[:3]
      batch = Batch(*(part[:own] for part in both))
      policy = Batch(*(part[own:] for part in both))
      finals = int(config.final_share * config.batch_size)
      expert = self._pool.sample(self.generator, config.batch_size, finals)
    else:
      batch = self._transitions(own)
    replayed = None if config.intentions_on_experts else batch
    if rows:
      shown = self._pool.sample_transitions(
        self.generator, rows, config.main_expert_share
      )
      batch = joined(batch, shown)
    return Draw(batch, policy, expert, replayed)

  def _transitions(self, rows: int) -> Batch:
    """Transitions of the replay, with their rewards if those are used."""
    indices = self._replay.sample_indices(self.generator, rows)
    if self._mirror is not None:
      observation, action, following = self._mirror.gather(indices)
    else:
      observation, action, following = map(
        torch.from_numpy, self._replay.gather(indices)
      )
    reward = None
    if self._columns:
      stored = self._replay.gather_rewards(indices)[:, self._columns]
      reward = torch.from_numpy(stored.T.copy()).to(self._device)
    return Batch(
      self._standardiser(observation),
      action,
      self._standardiser(following),
      reward,
    )

  @property
  def _pool(self) -> ExpertPool:
    assert self._experts is not None, "this config uses demonstrations"
    return self._experts
