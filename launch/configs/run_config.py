"""Every setting of a run but the agent's own."""

import dataclasses
from typing import Any

from pydantic import model_validator

from lfgp_dmc.agents.fields import (
  Count,
  Positive,
  PositiveInt,
  Processes,
  Switch,
  Text,
  checked,
)
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.launch.configs.algorithms import AgentConfig
from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from lfgp_dmc.task_names import ALL_TASKS, CONTROL_RATES

EPISODE_SECONDS = 18  # of the block tasks


@checked
class RunConfig:
  """One run, whatever its algorithm; steps are environment steps.

  The defaults here and those of the agent's config are the paper's; presets
  and flags change them, and `config.json` of the run holds the result.
  """

  algorithm: Text = "lfgp"
  main_task: Text = "stack"
  seed: Count = 0
  env_steps: PositiveInt = 4_000_000

  # Demonstrations.
  demonstrations: Text = ""  # dataset folder: a file a task
  pairs_per_task: Count = 0  # use the first so many of each file; 0: all
  attempts_per_task: Count = 0  # likewise whole attempts, instead; 0: all
  mirror_demonstrations: Switch = False  # and as many mirror images of them
  shifted_copies: Count = 0  # of all these, elsewhere in the plane
  collect_missing: Switch = False  # if there is no folder, as many as are used
  demonstrations_sha256: Text = ""  # of what was read; filled in by the run

  # Where the agent acts: ours, or `package.module:factory` of any dm_env.
  environment: Text = ""
  control_hz: PositiveInt = 20  # of the block tasks: 20, 10 or 5 steps a second
  # From pixels: the side of the block tasks' frames; 0: from the 59 floats. Of
  # another environment it means nothing.
  camera_size: Count = 0
  # Of another environment, which decides them; the block tasks': 18 s.
  episode_steps: Count = 0

  # Acting and updates; not of behaviour cloning.
  warm_up: PositiveInt = 1000  # transitions before the first update
  random_steps: Count = 1000  # first steps with actions from U[-1, 1]
  updates_per_step: Positive = 1.0  # the training loop holds this ratio

  # Other runs. One of the first: its networks, by task name, and its replay are
  # taken over. Of the second, a policy folder: its intentions alone.
  transfer_from: Text = ""
  transfer_updates: Count = 1000  # before the first step, if a task is new
  # The other main task's heads become ours (released: Stack -> Unstack-Stack).
  transfer_main_head: Switch = False
  init_from: Text = ""

  # When things happen.
  log_every: PositiveInt = 500
  evaluate_every: PositiveInt = 100_000
  checkpoint_every: PositiveInt = 20_000
  evaluate_first: Switch = False  # also the untrained agent

  # Evaluation: every intention, mean action, the same resets for all runs.
  evaluation_episodes: PositiveInt = 50  # a task
  evaluation_seed: Count = 0
  evaluation_workers: Processes = 0  # processes; 0: one a core

  # Resources.
  replay_capacity: PositiveInt = 4_000_000  # transitions, on disk as they come
  device: Text = "auto"  # cpu, cuda, ...; auto: cuda where there is one
  # 0: one a core that this process may use. Of two, one trains discriminators
  # while the other trains critics and intentions.
  threads: Processes = 1
  # Products in bfloat16, unless the CPU would emulate them; parameters stay
  # float32. Not for values in the hundreds, as of the paper's settings: they
  # are rounded to steps of 1, as much as actions differ.
  bfloat16: Switch = False
  cuda_graphs: Switch = True  # on a GPU: updates recorded, then replayed
  deterministic: Switch = False  # the same numbers again, after a resume too

  agent: AgentConfig = LfgpConfig()  # the algorithm's own settings

  @model_validator(mode="after")
  def _check_fields_together(self):
    """Raises ValueError that lists every fault."""
    faults = [
      *self._faults_of_environment(),
      *self._faults_of_demonstrations(),
      *self._faults_of_acting(),
      *self._faults_of_start(),
    ]
    if faults:
      raise ValueError("\n".join(faults))
    return self

  def _faults_of_environment(self):
    if self.environment and ":" not in self.environment:
      yield (
        f"environment is {self.environment!r}; valid: nothing (the block "
        "tasks) or package.module:factory"
      )
    if not self.environment and self.main_task not in ALL_TASKS:
      yield f"main_task is {self.main_task!r}; valid: {', '.join(ALL_TASKS)}"
    if self.control_hz not in CONTROL_RATES:
      rates = ", ".join(map(str, CONTROL_RATES))
      yield f"control_hz is {self.control_hz!r}; valid: {rates}"

  def _faults_of_demonstrations(self):
    for name, why in (
      ("mirror_demonstrations", "frames have no mirror image"),
      ("shifted_copies", "frames cannot be shifted so"),
    ):
      value = getattr(self, name)
      valid = f"{name} is {value}; valid: {type(value)()} with"
      if self.environment and value:
        yield (
          f"{valid} environment (only the block tasks' symmetries are known)"
        )
      if self._seen_size and value:
        yield f"{valid} camera_size ({why})"
    if self.attempts_per_task and self.pairs_per_task:
      yield (
        f"attempts_per_task is {self.attempts_per_task}; valid: 0 with "
        f"pairs_per_task={self.pairs_per_task}"
      )
    is_counted = self.attempts_per_task or self.pairs_per_task
    if self.collect_missing and (self.environment or not is_counted):
      yield (
        "collect_missing is True; valid: False without pairs_per_task or "
        "attempts_per_task, or with environment"
      )

  def _faults_of_acting(self):
    if self.warm_up > self.replay_capacity and not self.transfer_from:
      yield (
        f"warm_up is {self.warm_up}; valid: at most replay_capacity, "
        f"{self.replay_capacity}"
      )
    if self._seen_size and self.transfer_from:
      yield (
        f"transfer_from is {self.transfer_from!r}; valid: nothing with "
        "camera_size (its features would be another encoder's)"
      )

  def _faults_of_start(self):
    agent = self.agent
    if (
      isinstance(agent, LfgpConfig)
      and agent.prior.weight
      and not agent.pretraining.updates
      and not (self.init_from or self.transfer_from)
      and not self._seen_size  # which needs init_from anyway
    ):
      yield (
        f"agent.prior.weight is {agent.prior.weight}; valid: 0 without "
        "agent.pretraining.updates, init_from or transfer_from (the intentions "
        "would be held at random ones)"
      )
    if self.transfer_from and not isinstance(agent, LfgpConfig):
      yield (
        f"transfer_from is {self.transfer_from!r}; valid: nothing with "
        f"{self.algorithm}, which keeps no replay"
      )
    if not self.init_from:
      return
    valid = f"init_from is {self.init_from!r}; valid: nothing"
    if self.transfer_from:
      yield f"{valid} with transfer_from, which brings intentions"
    if not isinstance(agent, LfgpConfig):
      yield f"{valid} with {self.algorithm}"
    elif agent.pretraining.updates:
      yield f"{valid}, if there are agent.pretraining.updates"
    elif agent.shares_trunk:
      yield (
        f"{valid}, unless agent.networks.actor_trunk is own (the critics' "
        "loss would undo it)"
      )

  @property
  def environment_spec(self) -> EnvironmentSpec:
    """Where the agent acts."""
    return EnvironmentSpec(
      self.main_task, self.environment, self.control_hz, self._seen_size
    )

  @property
  def _seen_size(self) -> int:
    """Of the block tasks' frames; another environment has its own."""
    return 0 if self.environment else self.camera_size

  @property
  def most_episode_steps(self) -> int:
    """Steps of an episode, at most."""
    return self.episode_steps or EPISODE_SECONDS * self.control_hz

  def to_dict(self) -> dict[str, Any]:
    """What `config.json` holds; `configs.from_dict` reads it back."""
    return dataclasses.asdict(self)
