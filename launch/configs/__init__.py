"""What a run is told: defaults, presets, and the checked, frozen result."""

from lfgp_dmc.launch.configs.algorithms import ALGORITHMS, Algorithm
from lfgp_dmc.launch.configs.presets import PRESETS
from lfgp_dmc.launch.configs.resolve import (
  from_dict,
  make_config,
  to_run_config,
)
from lfgp_dmc.launch.configs.run_config import RunConfig

__all__ = [
  "ALGORITHMS",
  "PRESETS",
  "Algorithm",
  "RunConfig",
  "from_dict",
  "make_config",
  "to_run_config",
]
