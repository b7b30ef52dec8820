"""Every setting of a run but the agent's own, checked when it is made."""

import dataclasses
from typing import Any

from launch.configs import algorithms
from launch.worlds import World
from lfgp_dmc.task_names import ALL_TASKS, CONTROL_RATES


@dataclasses.dataclass(frozen=True, kw_only=True)
class RunConfig:
  """One run, whatever its algorithm; steps are environment steps.

  The defaults here and those of the agent's config are the paper's; presets
  and flags change them, and `config.json` of the run holds the result.
  """

  algorithm: str = "lfgp"
  main_task: str = "stack"
  seed: int = 0
  env_steps: int = 4_000_000

  # Demonstrations.
  demonstrations: str = ""  # dataset folder: a file a task
  pairs_per_task: int = 0  # use the first so many of each file; 0: all
  attempts_per_task: int = 0  # likewise whole attempts, instead; 0: all
  mirror_demonstrations: bool = False  # and as many mirror images of them
  collect_pairs: int = 0  # collect so many a task if there is no folder

  # Where the agent acts: ours, or `package.module:factory` of any dm_env.
  environment: str = ""
  control_hz: int = 20  # of the block tasks: 20, 10 or 5 steps a second

  # Another run: its networks, by task name, and its replay are taken over.
  transfer_from: str = ""

  # When things happen.
  log_every: int = 500
  evaluate_every: int = 100_000
  checkpoint_every: int = 20_000
  evaluate_first: bool = False  # also the untrained agent

  # Evaluation: every intention, mean action, the same resets for all runs.
  evaluation_episodes: int = 50  # a task
  evaluation_seed: int = 0
  evaluation_workers: int = 0  # processes; 0: one a core

  # Resources.
  replay_capacity: int = 4_000_000  # transitions
  device: str = "auto"  # cpu, cuda, ...; auto: cuda where there is one
  threads: int = 1  # of torch; 0: one a core that this process may use
  actor_process: bool = False  # act in another process, while this one learns
  deterministic: bool = False  # the same numbers again, after a resume too

  agent: Any = None  # the dataclass of the algorithm's own settings

  def __post_init__(self):
    """Raises ValueError that lists every field out of its range."""
    faults = [
      f"config.{name} is {getattr(self, name)!r}; valid: {least} or more"
      for least, names in _LEAST.items()
      for name in names.split()
      if not _is_integer(getattr(self, name)) or getattr(self, name) < least
    ]
    if self.algorithm not in algorithms.ALGORITHMS:
      faults.append(
        f"config.algorithm is {self.algorithm!r}; valid: "
        f"{', '.join(algorithms.ALGORITHMS)}"
      )
    if self.environment and ":" not in self.environment:
      faults.append(
        f"config.environment is {self.environment!r}; valid: nothing (the "
        "block tasks) or package.module:factory"
      )
    if not self.environment and self.main_task not in ALL_TASKS:
      faults.append(
        f"config.main_task is {self.main_task!r}; valid: {', '.join(ALL_TASKS)}"
      )
    if self.environment and self.mirror_demonstrations:
      faults.append(
        "config.mirror_demonstrations is True; valid: False with "
        "config.environment (only the block tasks' mirror image is known)"
      )
    if self.attempts_per_task and self.pairs_per_task:
      faults.append(
        f"config.attempts_per_task is {self.attempts_per_task}; valid: 0 with "
        f"config.pairs_per_task ({self.pairs_per_task})"
      )
    if self.control_hz not in CONTROL_RATES:
      faults.append(
        f"config.control_hz is {self.control_hz!r}; valid: "
        f"{', '.join(map(str, CONTROL_RATES))}"
      )
    steps, most = getattr(self.agent, "episode_steps", 0), 18 * self.control_hz
    if not self.environment and steps > most:
      faults.append(
        f"config.agent.episode_steps is {steps}; valid: at most {most}, 18 s "
        f"of {self.control_hz} Hz"
      )
    if faults:
      raise ValueError("\n".join(faults))

  @property
  def world(self) -> World:
    """Where the agent acts."""
    return World(self.main_task, self.environment, self.control_hz)

  @property
  def uses_demonstrations(self) -> bool:
    """Whether the agent learns from demonstrations at all."""
    return getattr(self.agent, "uses_demonstrations", True)

  @property
  def keeps_rewards(self) -> bool:
    """Whether the replay keeps dense rewards, and so the world shows them."""
    return getattr(self.agent, "keeps_rewards", False)

  def to_dict(self) -> dict[str, Any]:
    """What `config.json` holds; `configs.from_dict` reads it back."""
    return dataclasses.asdict(self)


def _is_integer(value: Any) -> bool:
  return isinstance(value, int) and not isinstance(value, bool)


_LEAST = {
  0: "seed pairs_per_task attempts_per_task collect_pairs evaluation_seed "
  "evaluation_workers threads",
  1: "env_steps log_every evaluate_every checkpoint_every "
  "evaluation_episodes replay_capacity",
}
