"""Learning from Guided Play: the paper's agent (Algorithm 1)."""

from typing import TYPE_CHECKING

from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.parts import AgentParts

if TYPE_CHECKING:
  from lfgp_dmc.agents.lfgp.agent import LfgpAgent

__all__ = ["LfgpConfig", "build"]


def build(config: LfgpConfig, parts: AgentParts) -> "LfgpAgent":
  """See `builder.build`; loads torch only now."""
  from lfgp_dmc.agents.lfgp import builder

  return builder.build(config, parts)
