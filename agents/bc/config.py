"""Every setting of behaviour cloning."""

from typing import Literal

from lfgp_dmc.agents.fields import (
  InputsConfig,
  NetworksConfig,
  OptimiserConfig,
  Positive,
  PositiveInt,
  ProperShare,
  checked,
)
from lfgp_dmc.agents.vision import EncoderConfig


@checked
class BcConfig:
  """Defaults are the paper's hyper-parameter table for BC algorithms."""

  inputs: InputsConfig = InputsConfig()
  encoder: EncoderConfig = EncoderConfig()
  networks: NetworksConfig = NetworksConfig(layout="separate")
  optimiser: OptimiserConfig = OptimiserConfig(max_gradient_norm=0.0)
  loss: Literal["squared_error", "likelihood"] = "squared_error"
  batch_size: PositiveInt = 256  # pairs a task
  learning_rate: Positive = 3e-4
  validation_share: ProperShare = 0.3  # of each task's pairs
  overfit_tolerance: PositiveInt = 100  # epochs without improvement

  uses_demonstrations = True
  keeps_rewards = False
