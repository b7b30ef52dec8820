"""The temperatures' loss (section 5 of Haarnoja et al., 2018b)."""

import torch

Metrics = dict[str, torch.Tensor]


def temperature_loss(
  log_temperature: torch.Tensor, log_prob: torch.Tensor, target_entropy: float
) -> tuple[torch.Tensor, Metrics]:
  """sum_k mean_b (-alpha_k (log pi_k + target entropy)).

  A policy with less entropy than the target makes its alpha grow.

  Args:
    log_temperature: [K], log alpha.
    log_prob: [K, B], without gradient.
    target_entropy: nats; -A, so -4 here (the paper's table prints 4).

  Returns:
    The loss, and alpha by task.
  """
  temperature = log_temperature.exp()
  excess = log_prob.detach().mean(-1) + target_entropy
  loss = -(temperature * excess).sum()
  return loss, {
    "loss/temperature": loss.detach(),
    "temperature": temperature.detach(),
  }
