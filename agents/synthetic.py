"""Made-up demonstrations and transitions, for tests and benchmarks."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.types import Transition


def demonstrations(
  tasks: Sequence[str],
  pairs: int,
  observation_size: int,
  action_size: int,
  seed: int = 0,
  attempt: int = 50,
) -> dict[str, Demonstrations]:
  """Draws `pairs` of each task: a cloud, with actions that depend on the state.

  Every `attempt`-th pair is marked as a success.
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
    made[task] = Demonstrations(
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


def replay(
  rows: Transition,
  rewards: np.ndarray | None = None,
  reward_tasks: Sequence[str] = (),
) -> Replay:
  """A full replay of transitions [N, ...], in memory."""
  count, observation_size = rows.observation.shape
  made = Replay(
    count,
    observation_size,
    rows.action.shape[1],
    reward_tasks=reward_tasks,
  )
  made.add_batch(rows, rewards)
  return made
