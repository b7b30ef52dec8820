"""The critics' loss (equation 8 of the paper) and its target (equation 9)."""

import torch

Metrics = dict[str, torch.Tensor]


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

  Returns:
    [K, B].
  """
  value = torch.minimum(next_q[0], next_q[1])
  return reward + discount * (value - temperature[:, None] * next_log_prob)


def critic_loss(
  q: torch.Tensor, target: torch.Tensor
) -> tuple[torch.Tensor, Metrics]:
  """Squared soft Bellman residual of both critics, without a half.

  Args:
    q: [2, K, B].
    target: [K, B], without gradient.

  Returns:
    The sum over critics and tasks of the mean over rows, and values by task.
  """
  loss = (q - target).square().mean(-1).sum()
  value = q.detach()
  return loss, {
    "loss/critic": loss.detach(),
    "q": value.mean((0, 2)),
    "q_max": value.abs().amax((0, 2)),
  }
