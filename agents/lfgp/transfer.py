"""What a new agent takes over from the networks of another, by task name.

Section 5.3 of the paper as the released code does it: trunks whole, heads of
the tasks that both have, the discriminator's hidden layers and its output
weights of those tasks (not their biases). Heads of new tasks stay random.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from torch import nn

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.lfgp.networks import LfgpNetworks

Arrays = Mapping[str, np.ndarray]


def carry_networks(
  networks: LfgpNetworks,
  source: Mapping[str, Arrays],
  tasks: Sequence[str],
  source_tasks: Sequence[str],
) -> None:
  """Carries all networks over; the targets become copies of the critics.

  Raises:
    ValueError: its networks have other sizes or layouts.
  """
  names = (tasks, source_tasks)
  carry(networks.intentions, source["intentions"], *names, "intentions")
  carry(networks.critics, source["critics"], *names, "critics")
  networks.critics.forget_hidden()
  name = "discriminator"
  if networks.discriminator is not None and name in source:
    # A main task's own discriminator stays with its task.
    ours = tasks[networks.main_discriminator is not None :]
    theirs = source_tasks["main_discriminator" in source :]
    carry(networks.discriminator, source[name], ours, theirs, name)
  networks.target_critics.load_state_dict(networks.critics.state_dict())


def carry(
  module: nn.Module,
  source: Arrays,
  tasks: Sequence[str],
  source_tasks: Sequence[str],
  what: str,
) -> None:
  """Carries a network over: all but the heads or outputs of other tasks.

  Heads lie on the first axis of `heads.*`: [K], or [2K], the twin leading; a
  discriminator's outputs on that of `output.*`.

  Raises:
    ValueError: the networks are of other sizes or layouts; starts with `what`.
  """
  merged = {**source}
  for name, own in serialisation.module_state(module).items():
    if name == "output.bias":
      merged[name] = own
    elif name in source and name.startswith(("heads.", "output.")):
      merged[name] = _merged(own, source[name], tasks, source_tasks)
  serialisation.load_module_state(module, merged, what)


def _merged(
  own: np.ndarray,
  other: np.ndarray,
  tasks: Sequence[str],
  source_tasks: Sequence[str],
) -> np.ndarray:
  """`own` [G K, ...] with the common tasks' parts of `other` [G K', ...]."""
  groups = len(own) // len(tasks)
  if other.shape != (groups * len(source_tasks), *own.shape[1:]):
    return other  # of another shape: refused where it is loaded
  merged = own.reshape(groups, len(tasks), -1).copy()
  parts = other.reshape(groups, len(source_tasks), -1)
  for index, task in enumerate(tasks):
    if task in source_tasks:
      merged[:, index] = parts[:, source_tasks.index(task)]
  return merged.reshape(own.shape)
