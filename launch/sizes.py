"""Sizes that no machine has room for, refused before anything is made."""

import os
import shutil

from lfgp_dmc.data import files
from lfgp_dmc.launch import configs
from lfgp_dmc.launch.command import UserError


def check(config: configs.RunConfig, folder: files.Path) -> None:
  """Raises UserError where even a lower bound of the need is too large.

  Each parameter has a gradient and two moments, each row of a batch a layer's
  outputs, each transition three numbers at least, on the disk of `folder`.
  """
  memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
  disk = shutil.disk_usage(files.existing_parent(folder)).total
  width, rows = config.agent.networks.hidden_size, config.replay_capacity
  needs = [
    ("agent.networks.hidden_size", width, 4 * width**2, memory),
    ("replay_capacity", rows, 3 * rows, disk),
  ]
  needs += [
    (name, value, value * width, memory)
    for name, value in configs.flattened(config.to_dict())
    if name.endswith("batch_size")
  ]
  for name, value, floats, room in needs:
    if 4 * floats > room:
      raise UserError(
        f"config.{name} is {value}: it needs at least {4e-9 * floats:,.0f} GB; "
        f"there are {1e-9 * room:,.0f} GB"
      )
