"""Sizes that no machine has room for, refused before anything is made."""

import os
import shutil

import torch

from lfgp_dmc.data import files
from lfgp_dmc.launch.assemble import Parts
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig


def check(config: RunConfig, parts: Parts, folder: files.Path) -> None:
  """Raises UserError if arrays cannot fit; names field, need and room.

  The needs are lower bounds: of a parameter there are itself, its gradient and
  two moments. The replay goes to the disk of `folder`.
  """
  memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
  if parts.device.type == "cuda":
    memory = torch.cuda.mem_get_info(parts.device)[1]
  row = 2 * parts.widths[0] + parts.widths[1]
  hidden, batch = config.agent.networks.hidden_size, config.agent.batch_size
  for field, value, floats, room in (
    ("agent.networks.hidden_size", hidden, 4 * hidden**2, memory),
    ("agent.batch_size", batch, batch * (row + hidden), memory),
    ("replay_capacity", config.replay_capacity, config.replay_capacity * row,
     shutil.disk_usage(folder).total),
  ):  # fmt: skip
    if 4 * floats > room:
      raise UserError(
        f"config.{field} is {value}: it needs {4 * floats / 1e9:,.0f} GB at "
        f"least; there are {room / 1e9:,.1f} GB"
      )


def is_too_large(error: BaseException) -> bool:
  """Whether memory ran out, or a size overflowed."""
  of_torch = isinstance(error, RuntimeError) and (
    "allocate" in str(error) or "overflow" in str(error)
  )
  return of_torch or isinstance(error, MemoryError | OverflowError)
