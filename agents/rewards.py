"""Rewards from a discriminator's logits, made anew at sample time."""

from collections.abc import Callable

import torch
from torch.nn import functional

# With D = sigmoid(logit), D high for the expert. Every form rises with the
# logit: what looks like the expert earns more.
FORMS: dict[str, Callable[[torch.Tensor], torch.Tensor]] = {
  # log D - log(1 - D): unbounded, both signs (the released code).
  "logit": lambda logit: logit,
  # D itself (the paper's text): 0..1, so it pays to live.
  "probability": torch.sigmoid,
  # -log(1 - D): above 0.
  "gail": functional.softplus,
  # log D: below 0.
  "log_probability": functional.logsigmoid,
}


def reward_from_logits(
  logits_expert_high: torch.Tensor,
  form: str = "logit",
  clip: float = 0.0,
  scale: float = 1.0,
) -> torch.Tensor:
  """Rewards of logits, any shape, by a key of `FORMS`; see `bounded`."""
  return bounded(FORMS[form](logits_expert_high), clip, scale)


def bounded(reward: torch.Tensor, clip: float, scale: float) -> torch.Tensor:
  """Clips to [-clip, clip], unless `clip` is 0; then scales."""
  if clip > 0:
    reward = reward.clamp(-clip, clip)
  return reward * scale
