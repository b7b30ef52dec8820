"""The tanh-squashed Gaussian of soft actor-critic."""

import math

import torch
from torch.nn import functional

_LOG_SQRT_2_PI = 0.5 * math.log(2.0 * math.pi)
_LOG_2 = math.log(2.0)


def log_one_minus_tanh_squared(value: torch.Tensor) -> torch.Tensor:
  """log(1 - tanh(value)^2) without loss of digits at large |value|."""
  return 2.0 * (_LOG_2 - value - functional.softplus(-2.0 * value))


def log_density(
  value: torch.Tensor, std: torch.Tensor, noise: torch.Tensor
) -> torch.Tensor:
  """The log density [...] of the actions tanh(value) [..., A], in nats.

  `noise` is (value - mean) / std.
  """
  log_prob = (
    -0.5 * noise * noise
    - torch.log(std)
    - _LOG_SQRT_2_PI
    - log_one_minus_tanh_squared(value)
  )
  return log_prob.sum(-1)


def sample(
  mean: torch.Tensor, std: torch.Tensor, noise: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
  """Actions tanh(mean + std * noise) [..., A], and their log densities [...].

  The reparameterisation trick; mean and std are before the tanh, the noise is
  from N(0, 1).
  """
  value = mean + std * noise
  return torch.tanh(value), log_density(value, std, noise)


def draw(
  mean: torch.Tensor, std: torch.Tensor, generator: torch.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
  """Draws the noise too; see `sample`."""
  noise = torch.randn(mean.shape, generator=generator, device=mean.device)
  return sample(mean, std, noise)
