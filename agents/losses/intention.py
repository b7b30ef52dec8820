"""Losses of the intentions and of their temperatures."""

import torch

from lfgp_dmc.agents.losses import Metrics


def intention_loss(
  log_prob: torch.Tensor, q: torch.Tensor, temperature: torch.Tensor
) -> tuple[torch.Tensor, Metrics]:
  """sum_k mean_b (alpha_k log pi_k(a | s) - min Q_k(s, a)), a from pi_k.

  Equation 7 of the paper, negated: it is minimised. The metrics hold each
  task's entropy estimate, mean -log pi, in nats.

  Args:
    log_prob: [K, B], of fresh actions.
    q: [2, K, B], both critics' values of the same actions.
    temperature: [K], alpha, without gradient.
  """
  value = torch.minimum(q[0], q[1])
  loss = (temperature[:, None] * log_prob - value).mean(-1).sum()
  return loss, {
    "loss/policy": loss.detach(),
    "entropy": -log_prob.detach().mean(-1),
  }


def temperature_loss(
  log_temperature: torch.Tensor, log_prob: torch.Tensor, target_entropy: float
) -> tuple[torch.Tensor, Metrics]:
  """sum_k mean_b (-alpha_k (log pi_k + target entropy)).

  Section 5 of Haarnoja et al., 2018b: a policy with less entropy than the
  target makes its alpha grow.

  Args:
    log_temperature: [K], log alpha.
    log_prob: [K, B], without gradient.
    target_entropy: nats; -A, so -4 here (the paper's table prints 4).
  """
  temperature = log_temperature.exp()
  excess = log_prob.detach().mean(-1) + target_entropy
  loss = -(temperature * excess).sum()
  return loss, {
    "loss/temperature": loss.detach(),
    "temperature": temperature.detach(),
  }
