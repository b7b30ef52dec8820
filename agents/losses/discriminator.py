"""The discriminators' loss (equation 3 of the paper) and its penalty."""

import torch
from torch.nn import functional

from lfgp_dmc.agents.losses import Metrics


def discriminator_loss(
  policy_logits: torch.Tensor, expert_logits: torch.Tensor
) -> tuple[torch.Tensor, Metrics]:
  """Binary cross-entropy, expert high (released code).

  0.5 [mean softplus(l_k(s, a)) + mean softplus(-l_k(s_E, a_E))], means over
  rows and tasks. The paper's equation 3 sums over tasks; the released code
  takes the mean and the half.

  Args:
    policy_logits: [B, K], every task's logit of the replay's rows.
    expert_logits: [N, K], task k's logit of task k's expert rows.
  """
  loss = 0.5 * (
    functional.softplus(policy_logits).mean()
    + functional.softplus(-expert_logits).mean()
  )
  policy, expert = policy_logits.detach(), expert_logits.detach()
  return loss, {
    "loss/discriminator": loss.detach(),
    "accuracy_policy": (policy < 0).float().mean(0),
    "accuracy_expert": (expert > 0).float().mean(0),
    "logit_policy": policy.mean(0),
    "logit_expert": expert.mean(0),
  }


def mix(
  policy: torch.Tensor, expert: torch.Tensor, share: torch.Tensor
) -> torch.Tensor:
  """Interpolates replay row i with expert row i of each task.

  share * policy + (1 - share) * expert, [K, N, I]; replay rows are reused in
  order if N > B.

  Args:
    policy: [B, I].
    expert: [K, N, I].
    share: from U(0, 1), [K, N, I], a number for every float (released code;
      Gulrajani et al., 2017, draw one for every row).
  """
  rows = expert.shape[1]
  if rows > policy.shape[0]:
    policy = policy.repeat(-(-rows // policy.shape[0]), 1)
  return torch.lerp(expert, policy[:rows].expand_as(expert), share)


def gradient_penalty_loss(
  gradient: torch.Tensor, weight: float = 10.0
) -> tuple[torch.Tensor, Metrics]:
  """Weight * mean (norm - 1)^2 (Gulrajani et al., 2017).

  Args:
    gradient: [K, N, I], derivative of the summed logits, or of each task's
      own, by the interpolated (s, a).
    weight: the paper's lambda.
  """
  norm = torch.linalg.vector_norm(gradient, dim=-1)
  loss = weight * (norm - 1).square().mean()
  return loss, {
    "loss/gradient_penalty": loss.detach(),
    "gradient_norm/discriminator_input": norm.detach().mean(),
  }
