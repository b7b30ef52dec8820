"""The intentions' loss (equation 7 of the paper, negated: it is minimised)."""

import torch

Metrics = dict[str, torch.Tensor]


def intention_loss(
  log_prob: torch.Tensor, q: torch.Tensor, temperature: torch.Tensor
) -> tuple[torch.Tensor, Metrics]:
  """sum_k mean_b (alpha_k log pi_k(a | s) - min Q_k(s, a)), a from pi_k.

  Args:
    log_prob: [K, B], of fresh actions.
    q: [2, K, B], both critics' values of the same actions.
    temperature: [K], alpha, without gradient.

  Returns:
    The loss, and each task's entropy estimate, mean -log pi, in nats.
  """
  value = torch.minimum(q[0], q[1])
  loss = (temperature[:, None] * log_prob - value).mean(-1).sum()
  return loss, {
    "loss/policy": loss.detach(),
    "entropy": -log_prob.detach().mean(-1),
  }
