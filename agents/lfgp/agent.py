"""The LfGP agent as the training loop sees it, and its builder."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import torch
import tqdm

from agents import serialisation
from agents.cloning import IntentionCloner
from agents.experts import (
  Batch,
  DemonstrationArrays,
  ExpertPool,
  check_sizes,
  pooled_observations,
)
from agents.lfgp.config import LfgpConfig
from agents.lfgp.learner import SCALAR_METRICS, TASK_METRICS, LfgpLearner
from agents.lfgp.networks import make_networks
from agents.metering import Meter
from agents.networks.trunk import Standardiser
from agents.policy import Policy
from agents.schedulers import Scheduler, make_scheduler, period_returns
from lfgp_dmc import seeding
from lfgp_dmc.types import Episode, Metrics, Transition

_CLONING_LOG_EVERY = 1000  # warm-start updates between readings of its loss


class Replay(Protocol):
  """The transitions that the agent samples; the training loop adds them."""

  def __len__(self) -> int:
    """Transitions stored."""

  def sample_indices(
    self, generator: np.random.Generator, count: int, /
  ) -> np.ndarray:
    """Draws int64 [count], uniform with replacement."""

  def gather(self, indices: np.ndarray, /) -> Transition:
    """Copies rows out: float32 arrays [n, ...]."""


class LfgpAgent:
  """Acts by the scheduler's intentions and learns from replay and experts."""

  def __init__(
    self,
    config: LfgpConfig,
    tasks: Sequence[str],
    learner: LfgpLearner,
    scheduler: Scheduler,
    experts: ExpertPool,
    replay: Replay,
    seed: int,
  ):
    """Puts the parts together; see `build`.

    Args:
      config: settings.
      tasks: names of the K tasks, the main task first.
      learner: networks and updates.
      scheduler: chooses intentions.
      experts: all tasks' demonstrations.
      replay: transitions, filled by the training loop.
      seed: of the agent's own random streams.
    """
    self.tasks = tuple(tasks)
    self.policy = Policy(learner.networks.intentions, tasks)
    self._config = config
    self._learner = learner
    self._scheduler = scheduler
    self._experts = experts
    self._replay = replay
    self._standardise = learner.networks.intentions.standardiser
    self._device = learner.networks.log_temperature.device
    self._acting = seeding.generator(seed, "acting")
    self._sampling = seeding.generator(seed, "sampling")
    self._meter = Meter(tasks, SCALAR_METRICS, TASK_METRICS, self._device)
    self._choices = np.zeros(len(self.tasks), np.int64)
    self._env_steps = 0
    self._episode_step = 0
    self._task = self.tasks[0]
    self._has_started = config.bc_warm_start_updates == 0

  @property
  def updates(self) -> int:
    """Updates made so far, warm start not counted."""
    return self._learner.updates

  @property
  def task(self) -> str:
    """The task whose intention acts now."""
    return self._task

  def prepare(self, progress_bar: bool = False) -> None:
    """Makes the warm start by behaviour cloning, if any is due.

    Args:
      progress_bar: whether to show its updates' rate and time left.
    """
    if not self._has_started:
      self._warm_start(progress_bar)
      self._has_started = True

  def begin_episode(self) -> None:
    """Starts an episode."""
    self._episode_step = 0
    self._scheduler.begin_episode()

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Samples the scheduled intention's action; steps the scheduler.

    Args:
      observation: float32 [O].

    Returns:
      float32 [A]; from U[-1, 1] during the first `random_steps` steps.
    """
    if self._episode_step % self._config.xi == 0:
      index = self._scheduler.next_task()
      self._choices[index] += 1
      self._task = self.tasks[index]
    self._episode_step += 1
    self._env_steps += 1
    if self._env_steps <= self._config.random_steps:
      size = self.policy.action_size
      return self._acting.uniform(-1, 1, size).astype(np.float32)
    return self.policy.act(
      observation, self._task, deterministic=False, generator=self._acting
    )

  def end_episode(self, episode: Episode) -> None:
    """Lets the scheduler learn from the main task's reward.

    Args:
      episode: the T steps since `begin_episode`.
    """
    reward = self._learner.rewards(
      self._standardise(self._put(episode.observation)),
      self._put(episode.action),
    )
    self._scheduler.end_episode(
      period_returns(
        reward[0].cpu().numpy(), self._config.xi, self._config.discount
      ).tolist()
    )

  def update(self) -> None:
    """Makes one update of all networks."""
    config, updates = self._config, self._learner.updates
    discriminator_batch = None
    if updates % config.discriminator_every == 0:
      discriminator_batch = self._sample(config.batch_size)
    expert = None
    if discriminator_batch is not None or config.bc_weight > 0:
      rows = config.discriminator_batch_size
      finals = int(config.discriminator_final_share * rows)
      expert = self._experts.sample(self._sampling, rows, finals)
    share = config.expert_share * config.expert_share_decay**updates
    batch = self._sample(config.batch_size, int(share * config.batch_size))
    self._meter.add(self._learner.update(batch, discriminator_batch, expert))

  def metrics(self) -> Metrics:
    """Means since the last call; NaN for what has not happened since."""
    means = self._meter.read()
    total = int(self._choices.sum())
    for task, count in zip(self.tasks, self._choices, strict=True):
      means[f"scheduler/{task}"] = float(count / total) if total else math.nan
    self._choices[:] = 0
    return means

  def scheduler_probabilities(self) -> dict[str, float]:
    """Task -> probability of being chosen next."""
    values = self._scheduler.probabilities().tolist()
    return dict(zip(self.tasks, values, strict=True))

  def policy_arrays(self) -> dict[str, np.ndarray]:
    """What acting needs, by name; with `policy_options`, a `Policy`."""
    return self.policy.arrays()

  def policy_options(self) -> dict[str, Any]:
    """The JSON-able options that go with `policy_arrays`."""
    return self.policy.options()

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values; taken between episodes."""
    return {
      "learner": self._learner.state_dict(),
      "scheduler": self._scheduler.state_dict(),
      "meter": self._meter.state_dict(),
      "choices": self._choices.copy(),
      "acting": serialisation.numpy_generator_state(self._acting),
      "sampling": serialisation.numpy_generator_state(self._sampling),
      "env_steps": self._env_steps,
      "has_started": self._has_started,
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self._learner.load_state_dict(state["learner"])
    self._scheduler.load_state_dict(state["scheduler"])
    self._meter.load_state_dict(state["meter"])
    self._choices[:] = state["choices"]
    serialisation.load_numpy_generator_state(self._acting, state["acting"])
    serialisation.load_numpy_generator_state(self._sampling, state["sampling"])
    self._env_steps = int(state["env_steps"])
    self._has_started = bool(state["has_started"])
    self._episode_step = 0

  def _put(self, array: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(np.asarray(array, np.float32)).to(self._device)

  def _sample(self, rows: int, expert_rows: int = 0) -> Batch:
    """Transitions of the replay, the last `expert_rows` from the experts."""
    indices = self._replay.sample_indices(self._sampling, rows - expert_rows)
    part = self._replay.gather(indices)
    batch = Batch(
      self._standardise(self._put(part.observation)),
      self._put(part.action),
      self._standardise(self._put(part.next_observation)),
    )
    if not expert_rows:
      return batch
    expert = self._experts.sample_transitions(self._sampling, expert_rows)
    return Batch(*map(torch.cat, zip(batch, expert, strict=True)))

  def _warm_start(self, progress_bar: bool) -> None:
    """Pure behaviour cloning; then the critics start from its trunk."""
    config = self._config
    cloner = IntentionCloner(
      self._learner.networks.intentions,
      config.bc_learning_rate,
      config.weight_decay,
      config.max_gradient_norm,
      config.bfloat16,
    )
    updates = tqdm.trange(
      1,
      config.bc_warm_start_updates + 1,
      desc="warm start",
      unit="update",
      disable=not progress_bar,
    )
    for update in updates:
      metrics = cloner.update(
        self._experts.sample(self._sampling, config.batch_size)
      )
      if update % _CLONING_LOG_EVERY == 0:
        loss = float(metrics["loss/behaviour_cloning"])
        updates.set_postfix(loss=f"{loss:.4f}")
    if config.actor_trunk == "shared":
      self._learner.adopt_intention_trunk()


def build(
  config: LfgpConfig,
  tasks: Sequence[str],
  demonstrations: Mapping[str, DemonstrationArrays],
  replay: Replay,
  seed: int,
  device: torch.device | str,
  observation_size: int,
  action_size: int,
) -> LfgpAgent:
  """Builds an LfGP agent.

  Args:
    config: settings.
    tasks: names of the K tasks, the main task first.
    demonstrations: task -> arrays.
    replay: transitions, filled by the training loop.
    seed: every random number of the agent follows from it.
    device: where to compute.
    observation_size: O.
    action_size: A.

  Returns:
    The agent; same seed and calls, same numbers.

  Raises:
    ValueError: demonstrations are missing or of other sizes, or the scheduler
      does not fit the tasks.
  """
  device = torch.device(device)
  observation = pooled_observations(demonstrations, tasks)
  check_sizes(demonstrations, tasks, observation_size, action_size)
  standardiser = Standardiser(observation_size)
  if config.standardise:
    standardiser.fit(observation, config.deviation_floor)
  standardiser.to(device)
  initial = torch.Generator().manual_seed(seeding.derive(seed, "networks"))
  networks = make_networks(
    config,
    len(tasks),
    observation_size,
    action_size,
    standardiser,
    initial,
    device,
  )
  noise = torch.Generator(device).manual_seed(seeding.derive(seed, "noise"))
  experts = ExpertPool(demonstrations, tasks, standardiser, device)
  if config.discriminator_final_share > 0:
    experts.check_finals()
  scheduler = make_scheduler(
    config,
    tasks,
    0,
    math.ceil(config.episode_steps / config.xi),
    seeding.generator(seed, "scheduler"),
  )
  learner = LfgpLearner(config, networks, noise)
  return LfgpAgent(config, tasks, learner, scheduler, experts, replay, seed)
