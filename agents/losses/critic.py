"""The critics' loss (equation 8 of the paper) and its target (equation 9)."""

import torch

from lfgp_dmc.agents.losses import Metrics


def soft_bellman_target(
  reward: torch.Tensor,
  next_q: torch.Tensor,
  next_log_prob: torch.Tensor,
  temperature: torch.Tensor,
  discount: float,
) -> torch.Tensor:
  """The target r + gamma (min Q'(s', a') - alpha log pi(a' | s')).

  The action a' is fresh, from pi_k. Always bootstrapped: an episode's end is
  a time limit, not a terminal state. The discount also covers the entropy term
  (released code; the paper prints it outside).

  Args:
    reward: [K, B].
    next_q: [2, K, B], the target critics' values.
    next_log_prob: [K, B].
    temperature: [K], alpha.
    discount: gamma.
  """
  value = torch.minimum(next_q[0], next_q[1])
  return reward + discount * (value - temperature[:, None] * next_log_prob)


def critic_loss(
  q: torch.Tensor, target: torch.Tensor, mask: torch.Tensor | None = None
) -> tuple[torch.Tensor, Metrics]:
  """Squared soft Bellman residual of both critics, without a half.

  The sum over critics and tasks of the mean over rows.

  Args:
    q: [2, K, B].
    target: [K, B], without gradient.
    mask: [K, B], 1 where a task learns from a row, else 0; None: all 1.
  """
  loss = masked_mean((q - target).square(), mask).sum()
  value = q.detach()
  return loss, {
    "loss/critic": loss.detach(),
    "q": value.mean((0, 2)),
    "q_max": value.abs().amax((0, 2)),
  }


def value_penalty_loss(
  q: torch.Tensor,
  low: torch.Tensor,
  high: torch.Tensor,
  weight: float,
  mask: torch.Tensor | None = None,
) -> tuple[torch.Tensor, Metrics]:
  """Penalty for values that no policy could have (the authors' later work).

  weight [max(Q - high, 0)^2 + max(low - Q, 0)^2], summed and averaged as the
  critics' loss that it is added to.

  Args:
    q: [2, K, B].
    low: [K, 1], the least possible value.
    high: [K, 1] or [K, B], the greatest.
    weight: the later paper's lambda.
    mask: as in `critic_loss`.
  """
  excess = torch.relu(q - high).square() + torch.relu(low - q).square()
  loss = weight * masked_mean(excess, mask).sum()
  return loss, {
    "loss/value_penalty": loss.detach(),
    "value_low": low.mean(-1),
    "value_high": high.mean(-1),
  }


def masked_mean(value: torch.Tensor, mask: torch.Tensor | None) -> torch.Tensor:
  """The mean over the last axis of the rows that the mask lets pass."""
  if mask is None:
    return value.mean(-1)
  return (value * mask).sum(-1) / mask.sum(-1)
