"""Rewards made anew at sample time: from logits, or by who owns a row."""

from collections.abc import Callable

import torch
from torch.nn import functional

# With D = sigmoid(logit), D high for the expert. Every variant rises with the
# logit: what looks like the expert earns more.
VARIANTS: dict[str, Callable[[torch.Tensor], torch.Tensor]] = {
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
  variant: str = "logit",
  clip: float = 0.0,
  scale: float = 1.0,
) -> torch.Tensor:
  """Each task's reward of each row.

  Args:
    logits_expert_high: any shape.
    variant: a key of `VARIANTS`.
    clip: bound on the absolute reward before scaling; 0: none.
    scale: factor on the reward, after the bound.

  Returns:
    Rewards of the same shape.

  Raises:
    ValueError: the variant is unknown.
  """
  if variant not in VARIANTS:
    raise ValueError(
      f"unknown reward {variant!r}; valid: {', '.join(VARIANTS)}"
    )
  return bounded(VARIANTS[variant](logits_expert_high), clip, scale)


def bounded(reward: torch.Tensor, clip: float, scale: float) -> torch.Tensor:
  """Clips to [-clip, clip], unless `clip` is 0; then scales."""
  if clip > 0:
    reward = reward.clamp(-clip, clip)
  return reward * scale


def reward_from_examples(owner: torch.Tensor, tasks: int) -> torch.Tensor:
  """+1 for a task's own examples of success, -1 for all else (SQIL's idea).

  Args:
    owner: int64 [B], the task that a row is an example of; -1: none.
    tasks: K.

  Returns:
    float32 [K, B].
  """
  own = torch.arange(tasks, device=owner.device)[:, None] == owner
  return 2.0 * own.float() - 1.0
