"""The LfGP agent as the training loop sees it, and its builder."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import tqdm

from lfgp_dmc import seeding
from lfgp_dmc.agents import cloning, serialisation
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp import pretraining, transfer
from lfgp_dmc.agents.lfgp.batches import BatchMaker, Replay, reward_columns
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.learner import LfgpLearner
from lfgp_dmc.agents.lfgp.metric_names import SCALAR_METRICS, TASK_METRICS
from lfgp_dmc.agents.metering import Meter
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.agents.schedulers import Scheduler, period_returns
from lfgp_dmc.types import Episode, Metrics


class LfgpAgent:
  """Acts by the scheduler's intentions and learns from replay and experts."""

  def __init__(
    self,
    config: LfgpConfig,
    tasks: Sequence[str],
    learner: LfgpLearner,
    scheduler: Scheduler,
    experts: ExpertPool | None,
    replay: Replay,
    seed: int,
  ):
    """Puts the parts together; see `build`.

    Args:
      config: settings.
      tasks: names of the K tasks, the main task first.
      learner: networks and updates.
      scheduler: chooses intentions.
      experts: all tasks' demonstrations; None if the config uses none.
      replay: transitions, filled by the training loop.
      seed: of the agent's own random streams.
    """
    self.tasks = tuple(tasks)
    self.policy = Policy(learner.networks.intentions, tasks)
    self._config = config
    self.learner = learner
    self._scheduler = scheduler
    self._experts = experts
    device = learner.networks.log_temperature.device
    self._standardise = learner.networks.intentions.standardiser
    self._acting = seeding.generator(seed, "acting")
    self._sampling = seeding.generator(seed, "sampling")
    self.batches = BatchMaker(
      config,
      tasks,
      replay,
      experts,
      self._standardise,
      device,
      self._sampling,
    )
    self._main_reward = 0
    if config.keeps_rewards:
      (self._main_reward,) = reward_columns(replay, tasks[:1])
    self._meter = Meter(tasks, SCALAR_METRICS, TASK_METRICS, device)
    self._choices = np.zeros(len(self.tasks), np.int64)
    self._env_steps = 0
    self._episode_step = 0
    self._task = self.tasks[0]
    self._first_updates = 0  # before the first step, after a transfer
    self._has_started = False

  @property
  def updates(self) -> int:
    """Updates made so far, warm start not counted."""
    return self.learner.updates

  @property
  def task(self) -> str:
    """The task whose intention acts now."""
    return self._task

  def start_from(self, policy: Policy) -> None:
    """Lets the intentions start as those of a policy, by task name.

    Args:
      policy: with the same sizes; its standardisation comes along, and so
        does its trunk, for the critics too unless `actor_trunk` is "own".

    Raises:
      ValueError: it has other sizes, or none of our tasks.
    """
    self._check_common(policy.tasks, "the policy")
    transfer.carry_heads(
      self.learner.networks.intentions,
      policy.arrays(),
      self.tasks,
      policy.tasks,
      "the policy",
    )
    self._refresh_inputs()
    self.learner.adopt_intention_trunk()

  def carry_over(
    self,
    networks: Mapping[str, Mapping[str, np.ndarray]],
    source_tasks: Sequence[str],
  ) -> None:
    """Takes over what another agent learned (section 5.2 of the paper).

    Temperatures, optimisers and scheduler stay fresh. If a task is new,
    `prepare` will make `transfer_updates` updates on the replay.

    Args:
      networks: `state_dict()["learner"]["networks"]` of the other agent.
      source_tasks: its tasks.

    Raises:
      ValueError: its networks have other sizes, or none of our tasks.
    """
    self._check_common(source_tasks, "the other run")
    own = self.learner.networks
    transfer.carry_networks(own, networks, self.tasks, source_tasks)
    self._refresh_inputs()
    if set(self.tasks) - set(source_tasks):
      self._first_updates = self._config.transfer_updates

  def prepare(self, progress_bar: bool = False) -> None:
    """Makes the updates that are due before the first step, if any.

    Args:
      progress_bar: whether to show the updates' rate and time left.
    """
    if self._has_started:
      return
    config, intentions = self._config, self.learner.networks.intentions
    if config.bc_warm_start_updates:
      assert self._experts is not None, "a warm start needs demonstrations"
      pretraining.clone(
        config, intentions, self._experts, self._sampling, progress_bar
      )
      self.learner.adopt_intention_trunk()
    self.learner.adopt_prior()
    has_precise_prior = (
      config.prior_weight > 0 and config.bc_loss == cloning.LIKELIHOOD
    )
    if has_precise_prior and self._experts is not None:
      pretraining.warn_of_precise_prior(
        config, self.tasks, intentions, self._experts
      )
    for _ in tqdm.trange(
      self._first_updates,
      desc="on the other run's replay",
      unit="update",
      disable=not (progress_bar and self._first_updates),
    ):
      self.update()
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
      self._choose()
    self._episode_step += 1
    self._env_steps += 1
    if self._env_steps <= self._config.random_steps:
      size = self.policy.action_size
      return self._acting.uniform(-1, 1, size).astype(np.float32)
    return self.policy.act(
      observation, self._task, deterministic=False, generator=self._acting
    )

  def _choose(self) -> None:
    index = self._scheduler.next_task()
    self._choices[index] += 1
    self._task = self.tasks[index]

  def end_episode(self, episode: Episode) -> None:
    """Lets the scheduler learn from the main task's reward.

    Args:
      episode: the T steps since `begin_episode`.
    """
    self._scheduler.end_episode(
      period_returns(
        self._main_rewards(episode), self._config.xi, self._config.discount
      ).tolist()
    )

  def update(self) -> None:
    """Makes one update of all networks."""
    draw = self.batches.draw(self.learner.updates)
    self._meter.add(self.learner.update(*draw))

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
      "learner": self.learner.state_dict(),
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
    self.learner.load_state_dict(state["learner"])
    self._scheduler.load_state_dict(state["scheduler"])
    self._meter.load_state_dict(state["meter"])
    self._choices[:] = state["choices"]
    serialisation.load_numpy_generator_state(self._acting, state["acting"])
    serialisation.load_numpy_generator_state(self._sampling, state["sampling"])
    self._env_steps = int(state["env_steps"])
    self._has_started = bool(state["has_started"])
    self._refresh_inputs()
    self._episode_step = 0

  def _main_rewards(self, episode: Episode) -> np.ndarray:
    """The main task's reward of each step, float [T]."""
    match self._config.reward_source:
      case "replay":
        assert episode.rewards is not None, "the loop keeps rewards"
        return episode.rewards[:, self._main_reward]
      case "examples":
        return np.full(len(episode.action), -self._config.reward_scale)
    put = self.batches.put
    inputs = self._standardise(put(episode.observation))
    return self.learner.rewards(inputs, put(episode.action))[0].cpu().numpy()

  def _check_common(self, source_tasks: Sequence[str], what: str) -> None:
    if not set(self.tasks) & set(source_tasks):
      raise ValueError(
        f"{what} has none of {', '.join(self.tasks)}; it has: "
        f"{', '.join(source_tasks)}"
      )

  def _refresh_inputs(self) -> None:
    """After the standardiser has changed."""
    if self._experts is not None:
      self._experts.refresh()
