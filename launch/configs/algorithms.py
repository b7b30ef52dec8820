"""The algorithms by name: their settings, tasks and builders."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from lfgp_dmc.agents import bc, lfgp
from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.types import ActingAgent, SupervisedAgent

AgentConfig = LfgpConfig | BcConfig  # what `RunConfig.agent` may be


@dataclasses.dataclass(frozen=True)
class Algorithm:
  """How an algorithm is made from a run's config."""

  agent_config: type[AgentConfig]
  build: Callable[[Any, AgentParts], ActingAgent | SupervisedAgent]
  # Config fields by dotted name, and groups that presets leave alone.
  defaults: Mapping[str, Any] = dataclasses.field(default_factory=dict)
  without: tuple[str, ...] = ()
  is_multitask: bool = True  # learns all of `task_set`, or the main task alone
  is_supervised: bool = False  # without acting; see `runs/supervised.py`


_LFGP = Algorithm(LfgpConfig, lfgp.build)
# The main task alone. `checkpoint_every` is in updates; checkpoints are small.
_BC = Algorithm(
  BcConfig,
  bc.build,
  {"checkpoint_every": 5_000, "agent.networks.layout": "separate"},
  is_multitask=False,
  is_supervised=True,
)

ALGORITHMS: dict[str, Algorithm] = {
  "lfgp": _LFGP,
  # Without a scheduler: only the main intention acts.
  "lfgp_ns": dataclasses.replace(
    _LFGP, defaults={"agent.scheduler.kind": "main_only"}
  ),
  # Discriminator-Actor-Critic: the main task alone.
  "dac": dataclasses.replace(
    _LFGP,
    defaults={
      "agent.scheduler.kind": "main_only",
      "agent.networks.layout": "separate",
    },
    is_multitask=False,
  ),
  # SAC-X on the dense rewards of all tasks: the paper's experts.
  "sacx": dataclasses.replace(
    _LFGP,
    defaults={
      # Masks are for few demonstrations; dense rewards hang on velocities.
      "agent.critic.masked": "",
      "agent.critic.revealed": "",
      "agent.critic.revealed_after": 0,
      "agent.reward.kind": "stored",
      "agent.scheduler.kind": "conditional_weighted",
      "random_steps": 0,
      "warm_up": 10_000,
    },
    without=("inputs", "pretraining", "prior"),  # which take demonstrations
  ),
  "bc": _BC,
  # As many pairs of the main task as a multitask method has.
  "bc_less": dataclasses.replace(
    _BC, defaults={**_BC.defaults, "pairs_per_task": 9000}
  ),
  "multitask_bc": dataclasses.replace(
    _BC,
    defaults={**_BC.defaults, "agent.networks.layout": "shared_trunk"},
    is_multitask=True,
  ),
}
