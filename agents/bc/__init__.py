"""Behaviour cloning, of the main task alone or of all tasks at once."""

from lfgp_dmc.agents.bc.agent import BcAgent, build
from lfgp_dmc.agents.bc.config import BcConfig

__all__ = ["BcAgent", "BcConfig", "build"]
