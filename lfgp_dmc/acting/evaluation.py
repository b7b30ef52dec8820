"""Evaluation: fixed seeded episodes of every intention, one row an episode.

The reset of episode i depends on (seed, i) alone: not on the task, the method,
the episodes before it, or the number of processes.
"""

import contextlib
import functools
from collections.abc import Callable, Sequence

import dm_env
from absl import logging

from lfgp_dmc import progress_bars, seeding
from lfgp_dmc.acting import environments, rollout
from lfgp_dmc.acting import workers as work
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from lfgp_dmc.types import Actor


def evaluate(
  make_environment: Callable[..., dm_env.Environment],
  make_actor: Callable[[], Actor],
  tasks: Sequence[str],
  episodes: int,
  seed: int,
  workers: int = 1,
  progress: bool = True,
  env_step: int = 0,
  draws: bool = False,
) -> list[EvaluationRow]:
  """Plays `episodes` whole episodes of each task in one environment.

  Args:
    make_environment: builds the main task's environment, which observes
      `reward/<task>` if it can; see `environments.reseeded`.
    make_actor: with several workers both must be picklable.
    tasks: the intentions to evaluate.
    episodes: of each task.
    seed: of resets and actors.
    workers: processes; 1 plays in this one.
    progress: whether to show a bar.
    env_step: goes into the rows, which come task by task.
    draws: whether the environment makes pictures.

  Raises:
    LostWorkerError: see `workers.ordered`.
  """
  jobs = [(task, i) for task in tasks for i in range(episodes)]
  workers = max(1, min(workers, len(jobs)))
  make_player = functools.partial(
    _Player, make_environment, make_actor, seed, env_step
  )
  results = work.ordered(make_player, jobs, workers, draws)
  bar = progress_bars.bar(
    results,
    total=len(jobs),
    desc="evaluating",
    unit="episode",
    show=progress,
    leave=False,
  )
  with contextlib.closing(results):
    return list(bar)


class _Player:
  """Plays whole episodes, one after the other."""

  def __init__(self, make_environment, make_actor, seed: int, env_step: int):
    self._make_environment = make_environment
    self._seed = seed
    self._env_step = env_step
    self._environment = make_environment()
    self._actor: Actor = make_actor()

  def __call__(self, job: tuple[str, int]) -> EvaluationRow:
    """Plays one whole episode; success never ends it."""
    task, episode = job
    self._environment = environments.reseeded(
      self._environment,
      self._make_environment,
      seeding.derive(self._seed, "evaluation", episode),
    )
    self._actor.begin(task, seeding.derive(self._seed, "actor", task, episode))
    timestep = self._environment.reset()
    steps, total, first = 0, 0.0, None
    for step in rollout.steps(self._environment, timestep, self._actor.act):
      timestep = step.timestep
      steps += 1
      total += float(environments.task_rewards(timestep, (task,))[0])
      if first is None and environments.has_succeeded(timestep, task):
        first = steps
    success: int | None = int(first is not None)
    if environments.has_succeeded(timestep, task) is None:
      success = None
    if environments.is_physics_failure(timestep) and success is not None:
      logging.warning(
        "physics failed in episode %d of %s at step %d: counted as a failure",
        episode,
        task,
        steps,
      )
      success, first = 0, None
    return EvaluationRow(
      self._env_step, task, episode, self._seed, success, first, total
    )

  def close(self) -> None:
    """Frees the environment."""
    self._environment.close()
