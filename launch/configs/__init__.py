"""The config of a run: defaults, presets, and the checked, frozen result."""

from lfgp_dmc.launch.configs.algorithms import ALGORITHMS, Algorithm
from lfgp_dmc.launch.configs.presets import PRESETS
from lfgp_dmc.launch.configs.resolve import (
  KIND,
  fill,
  from_dict,
  hint,
  make_config,
)
from lfgp_dmc.launch.configs.run_config import RunConfig
from lfgp_dmc.runs.pytree import flattened

__all__ = [
  "ALGORITHMS",
  "KIND",
  "PRESETS",
  "Algorithm",
  "RunConfig",
  "fill",
  "flattened",
  "from_dict",
  "hint",
  "make_config",
]
