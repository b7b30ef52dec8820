"""The training loop: environment -> replay -> updates -> rows, checkpoints.

Time limits are truncations: no transition is ever marked terminal. A LAST with
discount 0 is a physics failure: its episode's rows are withdrawn from the
replay and neither the scheduler nor the episode count sees it.
"""

import itertools
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import dm_env
import numpy as np
from absl import logging

from lfgp_dmc import finite, seeding
from lfgp_dmc.acting import environments, rollout
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.rounds import Rounds
from lfgp_dmc.runs.schedule import Progress, TrainSchedule
from lfgp_dmc.types import ActingAgent, Episode, Step


class EpisodeRounds(Rounds[ActingAgent]):
  """Trains an agent that acts, episode by episode."""

  def __init__(
    self,
    environment: dm_env.Environment,
    agent: ActingAgent,
    replay: Replay,
    schedule: TrainSchedule,
    log: MetricsLog,
    progress: Progress | None = None,
    seed: int = 0,
  ):
    """Starts the clock.

    Args:
      environment: any dm_env environment; one with `reseed` has each episode's
        start fixed by `seed` and the episode's number.
      agent: acts and learns; it samples from `replay` by itself.
      replay: where transitions go; with rewards if it keeps them.
      schedule: when things happen.
      log: gets a row each `log_every` steps and a last one.
      progress: of the checkpoint that is being resumed.
      seed: of the episodes' starts and the random actions.
    """
    super().__init__(agent, schedule, log, progress)
    self._environment = environment
    self._replay = replay
    self._seed = seed

  def _begin(self) -> None:
    self._agent.prepare(self._schedule.progress_bar)

  def _round(self) -> None:
    """Plays to the episode's end, or to the last step of the run."""
    progress, schedule = self.progress, self._schedule
    episode: list[Step] = []
    rewards: list[np.ndarray] = []
    left = min(schedule.env_steps - progress.env_step, sys.maxsize)
    for step in itertools.islice(self._steps(), left):
      progress.env_step += 1
      failed = environments.is_physics_failure(step.timestep)
      if failed:
        self._drop_episode(len(episode))
      else:
        rewards.append(self._store(step))
        episode.append(step)
        self._update()
      self._bar.update()
      if progress.env_step % schedule.log_every == 0:
        self._write_row()
    if not step.timestep.last():
      progress.cut_episodes += 1
    elif not failed:
      progress.episodes += 1
      self._agent.end_episode(_episode(episode, rewards))
    progress.is_complete = progress.env_step == schedule.env_steps
    if progress.is_complete and progress.env_step % schedule.log_every:
      self._write_row()

  def _steps(self) -> Iterator[Step]:
    """The next episode; each of its actions knows of all updates."""
    progress = self.progress
    number = progress.episodes + progress.physics_failures
    number += progress.cut_episodes  # as of a run that goes on past its end
    if hasattr(self._environment, "reseed"):
      seed = seeding.derive(self._seed, "training episode", number)
      self._environment.reseed(seed)
    random = seeding.generator(self._seed, "random actions", number)
    first = self._environment.reset()
    self._agent.begin_episode()

    def choose_action(observation: np.ndarray) -> np.ndarray:
      action = self._agent.act(observation)  # also steps the scheduler
      if progress.env_step < self._schedule.random_steps:
        return random.uniform(-1, 1, action.shape).astype(np.float32)
      return action

    return rollout.steps(self._environment, first, choose_action)

  def _store(self, step: Step) -> np.ndarray:
    """Adds a step to the replay; returns its rewards, float32 [R]."""
    tasks = self._replay.reward_tasks
    rewards = environments.task_rewards(step.timestep, tasks)
    if not finite.is_finite(rewards):
      where = f"the reward of environment step {self.progress.env_step}"
      raise finite.fault(where, dict(zip(tasks, rewards, strict=True)))
    self._replay.add(step.transition, rewards)
    return rewards

  def _drop_episode(self, rows: int) -> None:
    """Withdraws what was stored; updates made meanwhile may have seen it."""
    self.progress.physics_failures += 1
    self._replay.withdraw(min(rows, len(self._replay)))
    logging.warning(
      "physics failed at environment step %d, step %d of its episode: dropped",
      self.progress.env_step,
      rows + 1,
    )

  def _update(self) -> None:
    progress = self.progress
    if len(self._replay) < self._schedule.warmup_steps:
      return
    progress.update_credit += self._schedule.updates_per_step
    while progress.update_credit >= 1:
      self._agent.update()
      progress.update += 1
      progress.update_credit -= 1

  def _rates(self, seconds: float, steps: int, updates: int) -> dict[str, Any]:
    return {
      "steps_per_s": round(steps / seconds, 3),
      "updates_per_s": round(updates / seconds, 3),
      "episodes": self.progress.episodes,
      "physics_failures": self.progress.physics_failures,
      "replay_size": len(self._replay),
    }


def _episode(steps: Sequence[Step], rewards: Sequence[np.ndarray]) -> Episode:
  observations, actions, _ = zip(*(s.transition for s in steps), strict=True)
  kept = np.stack(rewards) if rewards[0].size else None
  return Episode(np.stack(observations), np.stack(actions), kept)
