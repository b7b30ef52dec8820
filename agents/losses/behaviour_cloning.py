"""Losses of behaviour cloning, and of the distance from a prior."""

import torch

from lfgp_dmc.agents.losses import Metrics
from lfgp_dmc.agents.networks import tanh_gaussian

# Of the likelihood: the mean before the tanh that fits an action of 1 is
# infinite, and the std that fits what an expert always does alike is 0.
MOST_ACTION = 0.95
LEAST_STD = 0.018  # before the tanh
# Of the divergence: a policy that explores may be as precise as the prior down
# to here, or its samples fail where its mean succeeds.
LEAST_COMPARED = 0.003


def behaviour_cloning_loss(
  mean: torch.Tensor,
  action: torch.Tensor,
  weight: torch.Tensor | None = None,
) -> tuple[torch.Tensor, Metrics]:
  """sum_a (tanh(mean) - a)^2, mean over rows, all tasks equal.

  Args:
    mean: [K, N, A], task k's mean before the tanh, for task k's rows.
    action: [K, N, A], the expert's.
    weight: [K], a factor a task; None: 1 / K each. By-task metrics have none.
  """
  error = (torch.tanh(mean) - action).square().sum(-1)
  return _over_tasks(error, weight)


def likelihood_loss(
  mean: torch.Tensor, std: torch.Tensor, action: torch.Tensor
) -> tuple[torch.Tensor, Metrics]:
  """-log pi(a | s), mean over rows, all tasks equal.

  Where the expert is precise, small errors weigh as much as large ones where
  it is not, and the intention learns how precise to be.

  Args:
    mean: [K, N, A], task k's mean before the tanh, for task k's rows.
    std: [K, N, A], likewise; below `LEAST_STD` it counts as that.
    action: [K, N, A], the expert's; clipped to +-`MOST_ACTION`.
  """
  std = std.clamp(min=LEAST_STD)
  value = torch.atanh(action.clamp(-MOST_ACTION, MOST_ACTION))
  noise = (value - mean) / std
  log_prob = tanh_gaussian.log_density(value, std, noise)
  return _over_tasks(-log_prob)


def divergence_loss(
  mean: torch.Tensor,
  std: torch.Tensor,
  prior_mean: torch.Tensor,
  prior_std: torch.Tensor,
  weight: torch.Tensor | None = None,
) -> tuple[torch.Tensor, Metrics]:
  """KL(pi || prior) in nats, mean over rows, all tasks equal.

  That of two Gaussians, as the tanh of both changes nothing; their mean and
  std are [K, N, A]. Where the prior is more precise than `LEAST_STD`, the
  means' distance counts in units of that, so that the intention can still
  move; std are compared as they are, down to `LEAST_COMPARED`. `weight` is as
  in `behaviour_cloning_loss`.
  """
  ratio = std / prior_std.clamp(min=LEAST_COMPARED)
  shift = (mean - prior_mean) / prior_std.clamp(min=LEAST_STD)
  divergence = 0.5 * (ratio.square() + shift.square() - 1.0) - ratio.log()
  return _over_tasks(divergence.sum(-1), weight)


def _over_tasks(
  by_row: torch.Tensor,
  weight: torch.Tensor | None = None,
) -> tuple[torch.Tensor, Metrics]:
  by_task = by_row.mean(-1)
  loss = by_task.mean() if weight is None else (weight * by_task).sum()
  return loss, {
    "loss/behaviour_cloning": loss.detach(),
    "behaviour_cloning": by_task.detach(),
  }
