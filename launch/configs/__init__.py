"""What a run is told: defaults, presets, and the checked, frozen result."""

from launch.configs.algorithms import ALGORITHMS, Algorithm
from launch.configs.presets import PRESETS
from launch.configs.resolve import from_dict, make_config, to_run_config
from launch.configs.run_config import RunConfig

__all__ = [
  "ALGORITHMS",
  "PRESETS",
  "Algorithm",
  "RunConfig",
  "from_dict",
  "make_config",
  "to_run_config",
]
