"""Learning from Guided Play: the paper's agent (Algorithm 1)."""

from lfgp_dmc.agents.lfgp.agent import LfgpAgent
from lfgp_dmc.agents.lfgp.builder import build
from lfgp_dmc.agents.lfgp.config import LfgpConfig

__all__ = ["LfgpAgent", "LfgpConfig", "build"]
