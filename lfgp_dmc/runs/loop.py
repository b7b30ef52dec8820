"""The training loop: environment -> replay -> updates -> rows, checkpoints.

Time limits are truncations: no transition is ever marked terminal. A LAST with
discount 0 is a physics failure: its episode's rows are withdrawn from the
replay and neither the scheduler nor the episode count sees it.
"""

import dataclasses
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

import dm_env
import numpy as np
import tqdm
from absl import logging

from lfgp_dmc import seeding
from lfgp_dmc.acting import environments
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.remote_acting import RemoteActor
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.signals import StopRequest, stop_request
from lfgp_dmc.types import Agent, Episode, Step, Transition


@dataclasses.dataclass(frozen=True)
class TrainSchedule:
  """When things happen, in environment steps unless said."""

  env_steps: int  # length of the whole run
  log_every: int = 500
  evaluate_every: int = 100_000  # at the first episode end at or after
  checkpoint_every: int = 100_000  # likewise
  warmup_steps: int = 1_000  # transitions in the replay before the first update
  random_steps: int = 0  # actions drawn uniformly from [-1, 1]
  updates_per_step: float = 1.0  # below 1: an update every few steps
  evaluate_first: bool = False  # also before the first step, once prepared
  progress_bar: bool = True

  def __post_init__(self):
    for name in ("log_every", "evaluate_every", "checkpoint_every"):
      if getattr(self, name) < 1:
        raise ValueError(f"{name} is {getattr(self, name)}; valid: 1 or more")
    for name in ("env_steps", "warmup_steps", "random_steps"):
      if getattr(self, name) < 0:
        raise ValueError(f"{name} is {getattr(self, name)}; valid: 0 or more")
    ratio = self.updates_per_step
    if not (math.isfinite(ratio) and ratio >= 0):
      raise ValueError(f"updates_per_step is {ratio}; valid: 0 or more")


@dataclasses.dataclass
class Progress:
  """How far a run is; `dataclasses.asdict` of it belongs in a checkpoint."""

  env_step: int = 0
  update: int = 0
  episodes: int = 0  # complete ones
  physics_failures: int = 0  # episodes dropped
  wall_s: float = 0.0
  update_credit: float = 0.0  # the fraction of an update that is due
  is_complete: bool = False  # reached its end, which may come early in BC


EvaluateFn = Callable[[int], Mapping[str, float]]
CheckpointFn = Callable[[Progress], object]


def train(
  environment: dm_env.Environment,
  agent: Agent,
  replay: Replay,
  schedule: TrainSchedule,
  log: MetricsLog,
  evaluate_fn: EvaluateFn | None = None,
  checkpoint_fn: CheckpointFn | None = None,
  *,
  seed: int = 0,
  progress: Progress | None = None,
  remote: RemoteActor | None = None,
) -> Progress:
  """Trains until `schedule.env_steps`, or until SIGINT or SIGTERM.

  A signal finishes the episode and writes a checkpoint, without rows or an
  evaluation that were not due, so that the resumed run equals one never
  stopped.

  Args:
    environment: any dm_env environment; one with `reseed` has each episode's
      start fixed by `seed` and the episode's number.
    agent: acts and learns; it samples from `replay` by itself.
    replay: where transitions go; with rewards if it keeps them.
    schedule: when things happen.
    log: gets a row each `log_every` steps and a last one.
    evaluate_fn: env_step -> success rate by task; writes its own rows.
    checkpoint_fn: stores agent, replay and the progress it is given.
    seed: of the episodes' starts and the random actions.
    progress: of the checkpoint that is being resumed.
    remote: plays the episodes while this process learns; it has a world of its
      own. None: they are played here, in turns with the updates.

  Returns:
    The progress; `is_complete` tells whether it was stopped.
  """
  loop = _Loop(
    environment, agent, replay, schedule, log, seed, progress, remote
  )
  with stop_request() as stop:
    loop.run(stop, evaluate_fn, checkpoint_fn)
  return loop.progress


class _Loop:
  """The state of one call of `train`."""

  def __init__(
    self, environment, agent, replay, schedule, log, seed, progress, remote
  ):
    self.progress: Progress = progress or Progress()
    self._remote: RemoteActor | None = remote
    self._environment: dm_env.Environment = environment
    self._agent: Agent = agent
    self._replay: Replay = replay
    self._schedule: TrainSchedule = schedule
    self._log: MetricsLog = log
    self._seed = seed
    self._flatten = environments.flattener(environment)
    self._start = time.monotonic() - self.progress.wall_s
    # For rates: when the last row was written, and at which counts.
    self._row_mark = (
      self._elapsed(),
      self.progress.env_step,
      self.progress.update,
    )

  def run(
    self,
    stop: StopRequest,
    evaluate_fn: EvaluateFn | None,
    checkpoint_fn: CheckpointFn | None,
  ) -> None:
    """Plays episodes; evaluates and checkpoints between them."""
    schedule, progress = self._schedule, self.progress
    progress.is_complete = progress.env_step >= schedule.env_steps
    self._agent.prepare(schedule.progress_bar)
    self._bar = tqdm.tqdm(
      total=schedule.env_steps,
      initial=progress.env_step,
      unit="step",
      disable=not schedule.progress_bar,
      mininterval=1.0,
    )
    with self._bar:
      if schedule.evaluate_first and evaluate_fn and not progress.env_step:
        self._evaluate(evaluate_fn)
      while progress.env_step < schedule.env_steps and not stop:
        before = progress.env_step
        self._play_episode()
        step, final = progress.env_step, progress.env_step == schedule.env_steps
        progress.is_complete = final
        if final and step % schedule.log_every:
          self._write_row()
        due = final or passed(before, step, schedule.evaluate_every)
        if due and evaluate_fn:
          self._evaluate(evaluate_fn)
        due = final or passed(before, step, schedule.checkpoint_every)
        if (due or stop) and checkpoint_fn:
          progress.wall_s = self._elapsed()
          checkpoint_fn(progress)

  def _play_episode(self) -> None:
    """Plays to the episode's end, or to the last step of the run."""
    progress, schedule = self.progress, self._schedule
    number = progress.episodes + progress.physics_failures
    steps = self._here(number)
    if self._remote is not None:
      steps = self._remote.episode(
        self._agent,
        seeding.derive(self._seed, "training episode", number),
        progress.env_step,
        schedule.env_steps - progress.env_step,
      )
    rows: list[Step] = []
    for step in steps:
      progress.env_step += 1
      if step.is_physics_failure:
        self._drop_episode(len(rows))
      else:
        self._replay.add(step.transition, step.rewards)
        rows.append(step)
        self._update()
      self._bar.update()
      if progress.env_step % schedule.log_every == 0:
        self._write_row()
    if step.is_last and not step.is_physics_failure:
      progress.episodes += 1
      self._agent.end_episode(_episode(rows))

  def _here(self, number: int) -> Iterator[Step]:
    """Plays an episode in this process; each step knows of all updates."""
    progress, schedule = self.progress, self._schedule
    if hasattr(self._environment, "reseed"):
      self._environment.reseed(
        seeding.derive(self._seed, "training episode", number)
      )
    random = seeding.generator(self._seed, "random actions", number)
    timestep = self._environment.reset()
    self._agent.begin_episode()
    observation = self._flatten(timestep.observation)
    while not timestep.last() and progress.env_step < schedule.env_steps:
      action = self._agent.act(observation)  # also steps the scheduler
      if progress.env_step < schedule.random_steps:
        action = random.uniform(-1, 1, action.shape).astype(np.float32)
      timestep = self._environment.step(action)
      reached = self._flatten(timestep.observation)
      yield Step(
        Transition(observation, action, reached),
        self._rewards(timestep),
        timestep.last(),
        environments.is_physics_failure(timestep),
      )
      observation = reached

  def _rewards(self, timestep: dm_env.TimeStep) -> np.ndarray | None:
    tasks = self._replay.reward_tasks
    return environments.task_rewards(timestep, tasks) if tasks else None

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

  def _write_row(self) -> None:
    progress = self.progress
    now = self._elapsed()
    then, step, update = self._row_mark
    seconds = max(now - then, 1e-9)
    self._row_mark = (now, progress.env_step, progress.update)
    self._log.write(
      {
        "env_step": progress.env_step,
        "update": progress.update,
        "wall_s": round(now, 3),
        "steps_per_s": round((progress.env_step - step) / seconds, 3),
        "updates_per_s": round((progress.update - update) / seconds, 3),
        "episodes": progress.episodes,
        "physics_failures": progress.physics_failures,
        "replay_size": len(self._replay),
        **self._agent.metrics(),
      }
    )

  def _evaluate(self, evaluate_fn: EvaluateFn) -> None:
    rates = evaluate_fn(self.progress.env_step)
    self._log.write_scalars(
      self.progress.env_step,
      {f"success/{task}": rate for task, rate in rates.items()},
    )
    self._bar.set_postfix({k: f"{rate:.0%}" for k, rate in rates.items()})

  def _elapsed(self) -> float:
    return time.monotonic() - self._start


def passed(before: int, now: int, every: int) -> bool:
  """Whether a multiple of `every` lies in (before, now]."""
  return before // every != now // every


def _episode(steps: Sequence[Step]) -> Episode:
  observations, actions, _ = zip(*(s.transition for s in steps), strict=True)
  rewards = [step.rewards for step in steps if step.rewards is not None]
  kept = np.stack(rewards) if rewards else None
  return Episode(np.stack(observations), np.stack(actions), kept)
