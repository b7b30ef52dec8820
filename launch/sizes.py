"""Sizes that no machine has room for, refused before anything is made."""

import os
import shutil

from lfgp_dmc.data import files
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig


def check(config: RunConfig, folder: files.Path) -> None:
  """Raises UserError where even a lower bound of the need is too large.

  Of a layer's parameters there are themselves, their gradients and two moments;
  of a transition at least three numbers, on the disk of `folder`.
  """
  memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
  disk = shutil.disk_usage(files.existing_parent(folder)).total
  width, rows = config.agent.networks.hidden_size, config.replay_capacity
  batch = config.agent.batch_size
  for name, value, floats, room in (
    ("agent.networks.hidden_size", width, 4 * width**2, memory),
    ("agent.batch_size", batch, batch * width, memory),
    ("replay_capacity", rows, 3 * rows, disk),
  ):
    if 4 * floats > room:
      raise UserError(
        f"config.{name} is {value}: it needs at least {4e-9 * floats:,.0f} GB; "
        f"there are {1e-9 * room:,.0f} GB"
      )
