"""The loss of behaviour cloning."""

import torch

Metrics = dict[str, torch.Tensor]


def behaviour_cloning_loss(
  mean: torch.Tensor,
  action: torch.Tensor,
  weight: torch.Tensor | None = None,
) -> tuple[torch.Tensor, Metrics]:
  """sum_a (tanh(mean) - a)^2, mean over rows, all tasks equal.

  Args:
    mean: [K, N, A], task k's mean before the tanh, for task k's rows.
    action: [K, N, A], the expert's.
    weight: [K], a factor a task; None: 1 / K each, the mean over tasks.

  Returns:
    The weighted sum over tasks, and the unweighted loss by task.
  """
  by_task = (torch.tanh(mean) - action).square().sum(-1).mean(-1)
  loss = by_task.mean() if weight is None else (weight * by_task).sum()
  return loss, {
    "loss/behaviour_cloning": loss.detach(),
    "behaviour_cloning": by_task.detach(),
  }
