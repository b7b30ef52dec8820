"""The LfGP agent as the training loop sees it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc import progress_bars, seeding
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp import transfer
from lfgp_dmc.agents.lfgp.batch_maker import BatchMaker
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.learner import LfgpLearner
from lfgp_dmc.agents.lfgp.metric_names import SCALAR_METRICS, TASK_METRICS
from lfgp_dmc.agents.lfgp.pretraining import Pretraining
from lfgp_dmc.agents.metering import Meter
from lfgp_dmc.agents.network_policy import NetworkPolicy
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.agents.schedulers import Scheduler, period_returns
from lfgp_dmc.data import files
from lfgp_dmc.types import Episode, Metrics


class LfgpAgent:
  """Acts by the scheduler's intentions and learns from replay and experts."""

  def __init__(
    self,
    config: LfgpConfig,
    tasks: Sequence[str],
    learner: LfgpLearner,
    batches: BatchMaker,
    scheduler: Scheduler,
    pretraining: Pretraining,
    experts: ExpertPool | None,
    seed: int,
  ):
    self.tasks = tuple(tasks)
    self.learner = learner
    self.batches = batches
    self.policy = NetworkPolicy(learner.networks.intentions, tasks)
    self._scheduler = scheduler
    self._pretraining = pretraining
    self._experts = experts
    self._acting = seeding.generator(seed, "acting")
    self._xi, self._discount = config.scheduler.xi, config.critic.discount
    device = learner.networks.log_temperature.device
    self._meter = Meter(tasks, SCALAR_METRICS, TASK_METRICS, device)
    self._choices = np.zeros(len(self.tasks), np.int64)
    self._episode_step = 0
    self._task = self.tasks[0]
    self._first_updates = 0  # before the first step, after a transfer
    self._has_started = False

  def start_from(self, policy: Policy) -> None:
    """Lets the intentions start as those of a policy, by task name.

    Its trunk and standardisation come along, its std as after pretraining.

    Raises:
      ValueError: it has other sizes, or none of our tasks.
    """
    self._check_source_tasks(policy.tasks, "the policy")
    transfer.carry(
      self.learner.networks.intentions,
      policy.arrays(),
      self.tasks,
      policy.tasks,
      "the policy",
    )
    if std := self._pretraining.config.std:
      self.learner.networks.intentions.heads.set_std(std)
    self._refresh()

  def carry_over(
    self,
    networks: Mapping[str, Mapping[str, np.ndarray]],
    source_tasks: Sequence[str],
    updates: int = 0,
    main_head: bool = False,
  ) -> None:
    """Takes over what another agent learned (section 5.3 of the paper).

    These are `state_dict()["learner"]["networks"]` of that agent.
    Temperatures, optimisers and scheduler stay fresh. If a task is new,
    `prepare` makes so many updates on the replay.

    Args:
      networks: by name.
      source_tasks: their tasks, the main task first.
      updates: see above.
      main_head: the heads of the other main task become those of ours, as the
        released code has it for Stack -> Unstack-Stack.

    Raises:
      ValueError: its networks have other sizes, or none of our tasks; or its
        main task is another task of ours.
    """
    self._check_source_tasks(source_tasks, "the other run", main_head)
    is_any_new = bool(set(self.tasks) - set(source_tasks))
    if main_head:
      main, *others = source_tasks
      if main in self.tasks:
        raise ValueError(
          f"the other run's main task {main} is a task of this run: its head "
          "is carried over under its own name"
        )
      source_tasks = (self.tasks[0], *others)
    own = self.learner.networks
    transfer.carry_networks(own, networks, self.tasks, source_tasks)
    self._refresh()
    if is_any_new:
      self._first_updates = updates

  def prepare(self, progress_bar: bool = False) -> None:
    """Makes the updates that are due before the first step, if any."""
    if self._has_started:
      return
    learner = self.learner
    intentions = learner.networks.intentions
    self._pretraining(
      intentions, self._experts, self.batches.generator, progress_bar
    )
    if learner.prior is not None:
      learner.prior.adopt(intentions)
      learner.prior.warn_if_precise(
        self.tasks, self._experts, learner.intentions.target_entropy
      )
    for _ in progress_bars.bar(
      range(self._first_updates),
      desc="on the other run's replay",
      unit="update",
      show=progress_bar and self._first_updates > 0,
    ):
      self.update()
    self._has_started = True

  def begin_episode(self) -> None:
    """Makes the scheduler choose anew."""
    self._episode_step = 0
    self._scheduler.begin_episode()

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Samples the scheduled intention's action [A]; steps the scheduler."""
    if self._episode_step % self._xi == 0:
      index = self._scheduler.next_task()
      self._choices[index] += 1
      self._task = self.tasks[index]
    self._episode_step += 1
    return self.policy.act(
      observation, self._task, deterministic=False, generator=self._acting
    )

  def end_episode(self, episode: Episode) -> None:
    """Lets the scheduler learn from the main task's reward."""
    rewards = self.learner.reward.main_rewards(episode)
    returns = period_returns(rewards, self._xi, self._discount)
    self._scheduler.end_episode(returns.tolist())

  def update(self) -> None:
    """Makes one update of all networks."""
    draw = self.batches.draw(self.learner.updates)
    self._meter.add(self.learner.update(draw))

  def metrics(self) -> Metrics:
    """Means since the last call; NaN for what has not happened since."""
    means = self._meter.read()
    total = int(self._choices.sum())
    for task, count in zip(self.tasks, self._choices, strict=True):
      means[f"scheduler/{task}"] = float(count / total) if total else math.nan
    self._choices[:] = 0
    return means

  def save_policy(
    self, folder: files.Path, config: Mapping[str, Any], env_step: int
  ) -> None:
    """Writes the current policy; see `Policy.save`."""
    self.policy.save(folder, config, env_step)

  def state_dict(self) -> dict[str, Any]:
    """Arrays and JSON-able values; taken between episodes."""
    return {
      "learner": self.learner.state_dict(),
      "scheduler": self._scheduler.state_dict(),
      "meter": self._meter.state_dict(),
      "choices": self._choices.copy(),
      "acting": self._acting.bit_generator.state,
      "sampling": self.batches.generator.bit_generator.state,
      "has_started": self._has_started,
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    self.learner.load_state_dict(state["learner"])
    self._scheduler.load_state_dict(state["scheduler"])
    self._meter.load_state_dict(state["meter"])
    self._choices[:] = state["choices"]
    self._acting.bit_generator.state = state["acting"]
    self.batches.generator.bit_generator.state = state["sampling"]
    self._has_started = bool(state["has_started"])
    self._refresh()
    self._episode_step = 0

  def _check_source_tasks(
    self, source_tasks: Sequence[str], what: str, main_head: bool = False
  ) -> None:
    new = [task for task in self.tasks if task not in source_tasks]
    if main_head and new[:1] == [self.tasks[0]]:
      del new[0]  # it gets a head under another name
    is_cloned = self._pretraining.config.updates > 0
    if new and self.learner.prior is not None and not is_cloned:
      raise ValueError(
        f"agent.prior.weight holds intentions near the first ones, and {what} "
        f"has none of {', '.join(new)}, which would be held at random ones; "
        "valid: agent.prior.weight=0"
      )
    if not set(self.tasks) & set(source_tasks):
      raise ValueError(
        f"{what} has none of {', '.join(self.tasks)}; it has: "
        f"{', '.join(source_tasks)}"
      )

  def _refresh(self) -> None:
    """After standardiser and networks have changed."""
    self.learner.networks.refresh()
    if self._experts is not None:
      self._experts.refresh()
