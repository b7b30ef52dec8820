"""The algorithms by name: their settings, tasks and builders."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from lfgp_dmc.agents import bc, lfgp
from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.types import ActingAgent, SupervisedAgent


@dataclasses.dataclass(frozen=True)
class Algorithm:
  """How an algorithm is made from a run's config."""

  summary: str
  agent_config: type  # a frozen dataclass with defaults for every field
  build: Callable[..., ActingAgent | SupervisedAgent]  # see `lfgp.build`
  defaults: Mapping[str, Any] = dataclasses.field(default_factory=dict)
  is_multitask: bool = True  # learns all of `task_set`, or the main task alone
  is_supervised: bool = (
    False  # by `lfgp_dmc/runs/supervised.py`, without acting
  )
  run_defaults: Mapping[str, Any] = dataclasses.field(default_factory=dict)

  def make_agent_config(self) -> Any:
    """The agent's config with this algorithm's defaults."""
    return self.agent_config(**self.defaults)


_CLONING = {"checkpoint_every": 5_000}  # updates; its checkpoints are small

ALGORITHMS: dict[str, Algorithm] = {
  "lfgp": Algorithm(
    "Learning from Guided Play with a learned scheduler",
    LfgpConfig,
    lfgp.build,
  ),
  "lfgp_ns": Algorithm(
    "the same without a scheduler: only the main intention acts",
    LfgpConfig,
    lfgp.build,
    defaults={"scheduler": "main_only"},
  ),
  "dac": Algorithm(
    "Discriminator-Actor-Critic: the main task alone, separate networks",
    LfgpConfig,
    lfgp.build,
    defaults={"scheduler": "main_only", "layout": "separate"},
    is_multitask=False,
  ),
  "sacx": Algorithm(
    "SAC-X on the dense rewards of all tasks: the paper's experts",
    LfgpConfig,
    lfgp.build,
    defaults={
      "reward_source": "replay",
      "scheduler": "conditional_weighted",
      "warm_up": 10_000,
      "random_steps": 0,
      # Nothing that needs demonstrations, or that fits other rewards.
      "reward_clip": 0.0,
      "reward_scale": 1.0,
      "expert_share": 0.0,
      "bc_weight": 0.0,
      "bc_warm_start_updates": 0,
      "prior_weight": 0.0,
      "standardise": False,
      "discriminator_noise": 0.0,
    },
  ),
  "bc": Algorithm(
    "behaviour cloning of the main task alone",
    BcConfig,
    bc.build,
    defaults={"layout": "separate"},
    is_multitask=False,
    is_supervised=True,
    run_defaults=_CLONING,
  ),
  "bc_less": Algorithm(
    "the same with less data: a multitask method's pairs of the main task",
    BcConfig,
    bc.build,
    defaults={"layout": "separate"},
    is_multitask=False,
    is_supervised=True,
    run_defaults={**_CLONING, "pairs_per_task": 9000},
  ),
  "multitask_bc": Algorithm(
    "behaviour cloning of all tasks, with a shared trunk",
    BcConfig,
    bc.build,
    defaults={"layout": "shared_trunk"},
    is_supervised=True,
    run_defaults=_CLONING,
  ),
}
