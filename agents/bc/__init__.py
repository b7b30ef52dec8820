"""Behaviour cloning, of the main task alone or of all tasks at once."""

from lfgp_dmc.agents.bc.config import BcConfig

__all__ = ["BcConfig", "build"]


def build(*parts, **options):
  """See `agent.build`; loads torch only now."""
  from lfgp_dmc.agents.bc import agent

  return agent.build(*parts, **options)
