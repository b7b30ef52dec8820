"""Learning from Guided Play: the paper's agent (Algorithm 1)."""

from lfgp_dmc.agents.lfgp.config import LfgpConfig

__all__ = ["LfgpConfig", "build"]


def build(*parts, **options):
  """See `builder.build`; loads torch only now."""
  from lfgp_dmc.agents.lfgp import builder

  return builder.build(*parts, **options)
