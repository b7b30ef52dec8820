"""Made-up demonstrations and transitions, for tests and benchmarks."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from lfgp_dmc.types import Transition


@dataclasses.dataclass(frozen=True)
class SyntheticDemonstrations:
  """One task's demonstrations: a cloud of its own in observations."""

  observation: np.ndarray  # float32 [N, O]
  action: np.ndarray  # float32 [N, A]
  next_observation: np.ndarray  # float32 [N, O]
  episode: np.ndarray  # int32 [N]
  is_last: np.ndarray  # bool [N]


def demonstrations(
  tasks: Sequence[str],
  pairs: int,
  observation_size: int,
  action_size: int,
  seed: int = 0,
  attempt: int = 50,
) -> dict[str, SyntheticDemonstrations]:
  """Draws a cloud for each task, with an action that depends on the state.

  Args:
    tasks: names of the K tasks.
    pairs: N for each task.
    observation_size: O.
    action_size: A.
    seed: of all numbers.
    attempt: pairs an episode; the last is marked as its success.

  Returns:
    Task -> demonstrations.
  """
  generator = np.random.default_rng(seed)
  matrix = generator.standard_normal((observation_size, action_size))
  episode = (np.arange(pairs) // attempt).astype(np.int32)
  is_last = np.arange(pairs) % attempt == attempt - 1

  def cloud() -> np.ndarray:
    centre = generator.standard_normal(observation_size)
    noise = 0.3 * generator.standard_normal((pairs, observation_size))
    return (centre + noise).astype(np.float32)

  made = {}
  for task in tasks:
    observation = cloud()
    action = 0.8 * np.tanh(observation @ matrix / observation_size**0.5)
    made[task] = SyntheticDemonstrations(
      observation,
      action.astype(np.float32),
      np.roll(observation, -1, axis=0),
      episode,
      is_last,
    )
  return made


def transitions(
  count: int, observation_size: int, action_size: int, seed: int = 0
) -> Transition:
  """Draws `count` transitions with random actions, arrays [count, ...]."""
  generator = np.random.default_rng(seed)
  observation = generator.standard_normal((count + 1, observation_size))
  action = generator.uniform(-1, 1, (count, action_size))
  return Transition(
    observation[:-1].astype(np.float32),
    action.astype(np.float32),
    observation[1:].astype(np.float32),
  )


class ArrayReplay:
  """A fixed replay over given transitions."""

  def __init__(
    self,
    rows: Transition,
    rewards: np.ndarray | None = None,
    reward_tasks: Sequence[str] = (),
  ):
    """Keeps the arrays [N, ...] and rewards [N, `reward_tasks`], if any."""
    self._rows = rows
    self._rewards = rewards
    self.reward_tasks = tuple(reward_tasks)

  def __len__(self) -> int:
    """Transitions stored."""
    return len(self._rows.action)

  def sample_indices(
    self, generator: np.random.Generator, count: int, /
  ) -> np.ndarray:
    """Draws int64 [count], uniform with replacement."""
    return generator.integers(len(self), size=count)

  def gather(self, indices: np.ndarray, /) -> Transition:
    """Copies rows out: float32 arrays [count, ...]."""
    return Transition(*(array[indices] for array in self._rows))

  def gather_rewards(self, indices: np.ndarray, /) -> np.ndarray:
    """Copies their rewards out: float32 [count, `reward_tasks`]."""
    assert self._rewards is not None, "this replay keeps no rewards"
    return self._rewards[indices]
