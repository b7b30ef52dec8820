"""What one update is fed with: by the config's source of reward."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import torch

from agents.experts import Batch, ExpertBatch, ExpertPool
from agents.lfgp.config import LfgpConfig
from agents.lfgp.device_rows import DeviceRows, RingReplay


class Replay(RingReplay, Protocol):
  """The transitions that the agent samples; the training loop adds them."""

  @property
  def reward_tasks(self) -> tuple[str, ...]:
    """The tasks whose dense rewards are kept beside each row."""

  def sample_indices(
    self, generator: np.random.Generator, count: int, /
  ) -> np.ndarray:
    """Draws int64 [count], uniform with replacement."""

  def gather_rewards(self, indices: np.ndarray, /) -> np.ndarray:
    """Copies their rewards out: float32 [n, `reward_tasks`]."""


class Draw(NamedTuple):
  """The arguments of `LfgpLearner.update`."""

  batch: Batch
  discriminator_batch: Batch | None
  expert: ExpertBatch | None


class BatchMaker:
  """Draws batches from the replay and from the experts."""

  def __init__(
    self,
    config: LfgpConfig,
    tasks: Sequence[str],
    replay: Replay,
    experts: ExpertPool | None,
    standardise: Callable[[torch.Tensor], torch.Tensor],
    device: torch.device,
    generator: np.random.Generator,
  ):
    """Keeps the sources.

    Args:
      config: settings.
      tasks: names of the K tasks, the main task first.
      replay: transitions; with all tasks' rewards if they are the reward.
      experts: demonstrations; may be None if the config uses none.
      standardise: raw observations -> network inputs.
      device: where batches go.
      generator: source of every index.

    Raises:
      ValueError: the replay keeps no rewards of some task that needs them, or
        a task has no row of success where such rows are needed.
    """
    self.generator = generator
    self._config = config
    self._replay = replay
    self._experts = experts
    self._standardise = standardise
    self._device = device
    # A GPU keeps a copy of the rows; see `device_rows.py`.
    self._rows = None
    if device.type != "cpu":
      self._rows = DeviceRows(replay, device)
    self._columns: list[int] = []
    if config.reward_source == "replay":
      self._columns = reward_columns(replay, tasks)
    needs_finals = config.reward_source == "examples"
    if experts and (needs_finals or config.discriminator_final_share > 0):
      experts.check_finals()

  def draw(self, updates: int) -> Draw:
    """Draws for one update.

    Args:
      updates: how many were made before.
    """
    config = self._config
    discriminator_batch = None
    is_due = updates % config.discriminator_every == 0
    if config.reward_source == "discriminator" and is_due:
      discriminator_batch = self._transitions(config.batch_size)
    expert = None
    if discriminator_batch is not None or config.bc_weight > 0:
      rows = config.discriminator_batch_size
      finals = int(config.discriminator_final_share * rows)
      expert = self._pool().sample(self.generator, rows, finals)
    return Draw(self._batch(updates), discriminator_batch, expert)

  def put(self, array: np.ndarray) -> torch.Tensor:
    """Copies an array to the device, float32."""
    return torch.from_numpy(np.asarray(array, np.float32)).to(self._device)

  def _batch(self, updates: int) -> Batch:
    """What critics and intentions learn from, expert rows last."""
    config = self._config
    rows = config.batch_size
    if config.reward_source == "examples":
      examples = int(config.example_share * rows)
      return with_examples(
        self._transitions(rows - examples),
        self._pool().sample_examples(
          self.generator, examples, config.example_noise
        ),
      )
    share = config.expert_share * config.expert_share_decay**updates
    expert_rows = int(share * rows)
    batch = self._transitions(rows - expert_rows)
    if not expert_rows:
      return batch
    expert = self._pool().sample_transitions(self.generator, expert_rows)
    return _joined(batch, expert)._replace(shown=expert_rows)

  def _transitions(self, rows: int) -> Batch:
    """Transitions of the replay, with their rewards if those are used."""
    indices = self._replay.sample_indices(self.generator, rows)
    observation, action, following = self._gather(indices)
    reward = None
    if self._columns:
      stored = self._replay.gather_rewards(indices)[:, self._columns]
      reward = self.put(stored.T)
    return Batch(
      self._standardise(observation),
      action,
      self._standardise(following),
      reward,
    )

  def _gather(self, indices: np.ndarray) -> tuple[torch.Tensor, ...]:
    if self._rows is not None:
      return self._rows.gather(indices)
    return tuple(map(self.put, self._replay.gather(indices)))

  def _pool(self) -> ExpertPool:
    assert self._experts is not None, "this config uses demonstrations"
    return self._experts


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


def with_examples(batch: Batch, examples: Batch) -> Batch:
  """Transitions of the replay, then examples of success, with owners."""
  assert examples.owner is not None
  none = torch.full_like(examples.owner[:1], -1).repeat(len(batch.action))
  return _joined(batch, examples)._replace(
    owner=torch.cat([none, examples.owner]), examples=examples.examples
  )


def _joined(one: Batch, other: Batch) -> Batch:
  """Both batches' transitions, one after the other."""
  return Batch(
    torch.cat([one.inputs, other.inputs]),
    torch.cat([one.action, other.action]),
    torch.cat([one.next_inputs, other.next_inputs]),
  )
