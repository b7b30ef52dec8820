"""Sizes that no machine has room for, refused before anything is made."""

import os
import shutil
from collections.abc import Iterator

import torch

from lfgp_dmc.data import files
from lfgp_dmc.launch.assemble import Parts
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig

_FLOAT = 4  # bytes
_COPIES = 4  # of a parameter: itself, its gradient, and two moments


def check(config: RunConfig, parts: Parts, folder: files.Path) -> None:
  """Compares what arrays need at the very least with what there is.

  Args:
    config: of the run.
    parts: of the run.
    folder: an existing one, of the disk that the replay goes to.

  Raises:
    UserError: they do not fit; names the field, the need and the room.
  """
  for field, value, need, room in _needs(config, parts, folder):
    if need > room:
      raise UserError(
        f"config.{field} is {value}: it needs {need / 1e9:,.0f} GB at least; "
        f"there are {room / 1e9:,.1f} GB"
      )


def is_too_large(error: BaseException) -> bool:
  """Whether memory ran out, or a size overflowed."""
  text = str(error)
  of_torch = isinstance(error, RuntimeError) and (
    "allocate" in text or "overflow" in text
  )
  return of_torch or isinstance(error, MemoryError | OverflowError)


def _needs(config, parts, folder) -> Iterator[tuple[str, int, int, int]]:
  """Field, its value, bytes that it needs, bytes that there are."""
  memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
  if parts.device.type == "cuda":
    memory = torch.cuda.mem_get_info(parts.device)[1]
  agent, tasks = config.agent, len(parts.tasks)
  hidden = agent.networks.hidden_size
  weights = _COPIES * tasks * hidden**2
  yield "agent.networks.hidden_size", hidden, _FLOAT * weights, memory
  row = 2 * parts.widths[0] + parts.widths[1]
  batch = agent.batch_size
  yield "agent.batch_size", batch, _FLOAT * batch * (row + hidden), memory
  capacity, disk = config.replay_capacity, shutil.disk_usage(folder).total
  yield "replay_capacity", capacity, _FLOAT * capacity * row, disk
