"""Learning from examples of success alone (the authors' later work).

Part of each batch are final states of demonstrations. A task's own earn +1,
all else -1 (SQIL's idea). Other tasks' critics do not learn from them, and no
intention does.
"""

import numpy as np
import torch

from lfgp_dmc.agents.batches import Batch, joined
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp.config import ExampleReward
from lfgp_dmc.agents.lfgp.networks import Training
from lfgp_dmc.agents.lfgp.reward_source import LabelledBatch, RewardSource
from lfgp_dmc.agents.networks import tanh_gaussian
from lfgp_dmc.agents.value_bounds import ValueBounds
from lfgp_dmc.types import Episode


class ExampleBounds(ValueBounds):
  """Bounds from rewards of -scale and +scale.

  The greatest value of the replay's rows is the examples' current value.
  """

  def __call__(
    self, reward: torch.Tensor, value: torch.Tensor
  ) -> tuple[torch.Tensor, torch.Tensor]:
    """See `ValueBounds`; rewards above 0 are those of a task's own examples."""
    own = reward > 0
    mean = (value * own).sum(1) / own.sum(1)
    high = self._median(torch.stack([mean, mean]))[0]
    most = reward.abs() * self._horizon
    return -most[:, :1], torch.where(own, most, high[:, None])


class ExampleRewards(RewardSource):
  """Rewards by the task that a row is an example of."""

  bounds = ExampleBounds

  def __init__(self, config: ExampleReward, batch_size: int, shared: Training):
    """`batch_size` counts examples in; ValueError if some task has none."""
    networks, _, self._generator, self._dtype = shared
    temperature = networks.log_temperature
    rows, count = example_rows(config, batch_size), len(temperature)
    if rows < count:
      raise ValueError(
        f"agent.batch_size is {batch_size}; valid: more, since "
        f"agent.reward.share of it are {rows} examples of {count} tasks"
      )
    self._scale = config.scale
    self._policy_rows = batch_size - rows
    self._intentions = networks.intentions
    tasks = torch.arange(count, device=temperature.device)
    self._tasks = tasks[:, None]

  def label(self, batch: Batch) -> LabelledBatch:
    """Gives examples fresh actions, and each row its reward and mask."""
    assert batch.example_task is not None, "batches have examples"
    own = batch.example_task == self._tasks
    return LabelledBatch(
      batch.inputs,
      self._with_fresh_actions(batch, batch.example_task),
      batch.next_inputs,
      self._scale * (2.0 * own.float() - 1.0),
      ((batch.example_task < 0) | own).float(),
      self._policy_rows,
    )

  def main_rewards(self, episode: Episode) -> np.ndarray:
    """-scale at each step: what is played is no example."""
    return np.full(len(episode.action), -self._scale)

  @torch.no_grad()
  def _with_fresh_actions(
    self, batch: Batch, example_task: torch.Tensor
  ) -> torch.Tensor:
    """[B, A], each example's drawn from its task's intention."""
    first = self._policy_rows
    inputs = batch.inputs[first:].to(self._dtype)
    mean, std = self._intentions(inputs)
    action, _ = tanh_gaussian.draw(mean, std, self._generator)
    rows = torch.arange(len(inputs), device=action.device)
    return torch.cat([batch.action[:first], action[example_task[first:], rows]])


def example_rows(config: ExampleReward, batch_size: int) -> int:
  """How many of a batch's rows are examples."""
  return int(config.share * batch_size)


def with_examples(
  batch: Batch,
  pool: ExpertPool,
  generator: np.random.Generator,
  rows: int,
  noise: float,
) -> Batch:
  """Adds states of success, in equal shares; the rest is the main task's.

  An example stands for staying where it is: its next state is itself, with
  noise of its own, whose std is in those of the task's own demonstrations.
  """
  task = pool.split(rows)
  state, action = pool.sample_finals(generator, task)
  example_task = torch.from_numpy(task).to(state.device)
  std = noise * pool.next_stds[example_task]

  def disturbed() -> torch.Tensor:
    drawn = generator.standard_normal(state.shape, np.float32)
    return state + std * torch.from_numpy(drawn).to(state.device)

  both = joined(batch, Batch(disturbed(), action, disturbed()))
  none = example_task.new_full((len(batch.action),), -1)
  return both._replace(example_task=torch.cat([none, example_task]))
