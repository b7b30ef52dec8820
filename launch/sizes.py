"""Sizes that no machine has room for, refused before anything is made."""

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator

from lfgp_dmc import task_names
from lfgp_dmc.data import files
from lfgp_dmc.launch import configs
from lfgp_dmc.launch.command import UserError

_MAKE_MEMORY = ("_size", "_copies", "_window")  # how such fields end


def check(config: configs.RunConfig, folder: files.Path) -> None:
  """Raises UserError where even a lower bound of the need is too large.

  Each parameter has a gradient and two moments, each row of a batch two layers'
  outputs, each transition three numbers at least, on the disk of `folder`.
  """
  disk = shutil.disk_usage(files.existing_parent(folder)).total
  fields = dict(configs.flattened(config.to_dict()))
  rows = config.replay_capacity
  width = fields.get("agent.networks.hidden_size", 1)
  of_algorithm = configs.ALGORITHMS[config.algorithm]
  tasks = 1
  if of_algorithm.is_multitask and not config.environment:
    tasks = len(task_names.task_set(config.main_task))
  # A task's intention; if it acts, its critics and their targets too.
  squares = tasks * (4 if of_algorithm.is_supervised else 14)
  refuse("agent.networks.hidden_size", width, squares * width**2)
  refuse("replay_capacity", rows, 3 * rows, disk)
  for name, value in fields.items():
    if name.endswith("batch_size"):
      refuse(name, value, 2 * tasks * value * width)


def refuse(name: str, value: int, floats: int, room: int | None = None) -> None:
  """Raises UserError if so many floats are more bytes than room, or memory."""
  if room is None:
    room = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
  if 4 * floats > room:
    raise UserError(
      f"config.{name} is {value}: it needs at least {4e-9 * floats:,.0f} GB; "
      f"there are {1e-9 * room:,.0f} GB"
    )


def is_memory_fault(error: BaseException) -> bool:
  """Whether NumPy, torch (on any device) or the system had no memory."""
  if isinstance(error, RuntimeError):  # torch's
    return "allocate" in str(error)
  is_systems = isinstance(error, OSError) and error.errno == errno.ENOMEM
  return isinstance(error, MemoryError) or is_systems


@contextlib.contextmanager
def told(config: configs.RunConfig) -> Iterator[None]:
  """Turns want of memory into a UserError that names what makes it."""
  try:
    yield
  except Exception as error:
    if not is_memory_fault(error):
      raise
    reason = str(error).partition("\n")[0] or "NumPy got none"
    makers = [
      f"config.{name} ({value})"
      for name, value in configs.flattened(config.to_dict())
      if name.endswith(_MAKE_MEMORY) and value
    ]
    raise UserError(
      f"out of memory: {reason}; smaller values of these need less: "
      + ", ".join(makers)
    ) from error
