"""Every setting of behaviour cloning, checked when it is made."""

import dataclasses

from lfgp_dmc.agents import cloning, field_checks
from lfgp_dmc.agents.networks import layouts


@dataclasses.dataclass(frozen=True, kw_only=True)
class BcConfig:
  """Defaults are the paper's hyper-parameter table for BC algorithms."""

  # Network.
  hidden_size: int = 256
  layout: str = layouts.SEPARATE  # multitask BC: "shared_trunk"
  standardise: bool = False  # inputs by the demonstrations' mean, deviation
  deviation_floor: float = 0.01  # smallest deviation, in the input's unit
  fine_scale: float = 0.0  # c of inputs tanh(x / c) beside x (m); 0: none
  bfloat16: bool = False  # products in bfloat16; parameters stay float32

  # Training.
  loss: str = cloning.SQUARED_ERROR  # or "likelihood"
  batch_size: int = 256  # pairs a task
  learning_rate: float = 3e-4
  weight_decay: float = 0.0  # above 0: AdamW
  max_gradient_norm: float = 0.0  # 0: none
  validation_share: float = 0.3  # of each task's pairs
  overfit_tolerance: int = 100  # epochs without improvement before the end

  def __post_init__(self):
    """Raises ValueError that lists every field out of its range."""
    faults = field_checks.faults(self, _RANGES, _CHOICES)
    if faults:
      raise ValueError(f"BcConfig: {'; '.join(faults)}")


_CHOICES = {"layout": layouts.LAYOUTS, "loss": cloning.LOSSES}
_RANGES = {
  "an integer above 0": "hidden_size batch_size overfit_tolerance",
  "a number above 0": "deviation_floor learning_rate",
  "a number, 0 or more": "weight_decay max_gradient_norm fine_scale",
  "a number above 0, below 1": "validation_share",
  "True or False": "standardise bfloat16",
}
