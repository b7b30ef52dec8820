"""Learning from Guided Play: the paper's agent (Algorithm 1)."""

from agents.lfgp.agent import LfgpAgent
from agents.lfgp.builder import build
from agents.lfgp.config import LfgpConfig

__all__ = ["LfgpAgent", "LfgpConfig", "build"]
