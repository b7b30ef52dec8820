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
  agent_config: type[LfgpConfig] | type[BcConfig]
  build: Callable[..., ActingAgent | SupervisedAgent]  # see `lfgp.build`
  # Config fields by dotted name, and groups that presets leave alone.
  defaults: Mapping[str, Any] = dataclasses.field(default_factory=dict)
  without: tuple[str, ...] = ()
  is_multitask: bool = True  # learns all of `task_set`, or the main task alone
  is_supervised: bool = False  # without acting; see `runs/supervised.py`


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
    {"agent.scheduler.kind": "main_only"},
  ),
  "dac": Algorithm(
    "Discriminator-Actor-Critic: the main task alone, separate networks",
    LfgpConfig,
    lfgp.build,
    {"agent.scheduler.kind": "main_only", "agent.networks.layout": "separate"},
    is_multitask=False,
  ),
  "sacx": Algorithm(
    "SAC-X on the dense rewards of all tasks: the paper's experts",
    LfgpConfig,
    lfgp.build,
    {
      "agent.reward.kind": "stored",
      "agent.scheduler.kind": "conditional_weighted",
      "random_steps": 0,
      "warm_up": 10_000,
    },
    without=("inputs", "pretraining", "prior"),  # which take demonstrations
  ),
  "bc": Algorithm(
    "behaviour cloning of the main task alone",
    BcConfig,
    bc.build,
    {**_CLONING, "agent.networks.layout": "separate"},
    is_multitask=False,
    is_supervised=True,
  ),
  "bc_less": Algorithm(
    "the same with less data: a multitask method's pairs of the main task",
    BcConfig,
    bc.build,
    {**_CLONING, "agent.networks.layout": "separate", "pairs_per_task": 9000},
    is_multitask=False,
    is_supervised=True,
  ),
  "multitask_bc": Algorithm(
    "behaviour cloning of all tasks, with a shared trunk",
    BcConfig,
    bc.build,
    {**_CLONING, "agent.networks.layout": "shared_trunk"},
    is_supervised=True,
  ),
}
