"""Behaviour cloning, of the main task alone or of all tasks at once."""

from typing import TYPE_CHECKING

from lfgp_dmc.agents.bc.config import BcConfig
from lfgp_dmc.agents.parts import AgentParts

if TYPE_CHECKING:
  from lfgp_dmc.agents.bc.agent import BcAgent

__all__ = ["BcConfig", "build"]


def build(config: BcConfig, parts: AgentParts) -> "BcAgent":
  """See `agent.build`; loads torch only now."""
  from lfgp_dmc.agents.bc import agent

  return agent.build(config, parts)
