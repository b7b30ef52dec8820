"""Behaviour cloning, of the main task alone or of all tasks at once."""

from agents.bc.agent import BcAgent, build
from agents.bc.config import BcConfig

__all__ = ["BcAgent", "BcConfig", "build"]
