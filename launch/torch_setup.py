"""torch, set up as a run's config says."""

import os

import torch
from absl import logging

from lfgp_dmc.agents.networks.linear import has_bfloat16
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig

_DETERMINISTIC_CUBLAS = ":4096:8"


def apply(config: RunConfig) -> torch.device:
  """Sets threads and determinism; returns the device.

  Raises:
    UserError: torch has no such device.
  """
  torch.set_num_threads(config.threads or command.cores())
  if config.deterministic:
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", _DETERMINISTIC_CUBLAS)
    torch.use_deterministic_algorithms(True)
  name = config.device
  if name == "auto":
    name = "cuda" if torch.cuda.is_available() else "cpu"
  try:
    device = torch.device(name)
    torch.zeros(1, device=device)
  except (RuntimeError, AssertionError, NotImplementedError) as error:
    reason = str(error).partition("\n")[0]
    raise UserError(
      f"config.device is {config.device!r}: {reason}; valid: auto, cpu, or "
      "cuda where this build of torch finds one"
    ) from None
  if config.bfloat16 and not uses_bfloat16(config, device):
    logging.warning(
      "config.bfloat16: this CPU would emulate products in bfloat16, many "
      "times slower; they are made in float32"
    )
  return device


def uses_bfloat16(config: RunConfig, device: torch.device) -> bool:
  """Whether products are asked for in bfloat16 and the processor has them."""
  return config.bfloat16 and (device.type != "cpu" or has_bfloat16())
