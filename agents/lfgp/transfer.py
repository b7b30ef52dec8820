"""What a new agent takes over from the networks of another, by task name.

Section 5.2 of the paper as the released code does it: trunks whole, heads of
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
  carry_heads(networks.intentions, source["intentions"], *names, "intentions")
  carry_heads(networks.critics, source["critics"], *names, "critics")
  if networks.discriminator is not None and "discriminator" in source:
    # A main task's own discriminator stays with its task.
    ours = tasks[networks.main_discriminator is not None :]
    theirs = source_tasks["main_discriminator" in source :]
    carry_discriminator(
      networks.discriminator, source["discriminator"], ours, theirs
    )
  networks.target_critics.load_state_dict(networks.critics.state_dict())


def carry_heads(
  module: nn.Module,
  source: Arrays,
  tasks: Sequence[str],
  source_tasks: Sequence[str],
  what: str,
) -> None:
  """Carries intentions or critics over: all but the heads of other tasks.

  Heads lie on the first axis of `heads.*`: [K], or [2K], the twin leading.

  Raises:
    ValueError: the networks are of other sizes or layouts; starts with `what`.
  """
  merged = {**source}
  for name, own in serialisation.module_state(module).items():
    if name.startswith("heads.") and name in source:
      merged[name] = _merged(own, source[name], tasks, source_tasks)
  serialisation.load_module_state(module, merged, what)


def carry_discriminator(
  module: nn.Module,
  source: Arrays,
  tasks: Sequence[str],
  source_tasks: Sequence[str],
) -> None:
  """Carries hidden layers and the output weights of common tasks over.

  Raises:
    ValueError: the networks are of other sizes.
  """
  own = serialisation.module_state(module)
  weight, bias = "output.weight", "output.bias"
  merged = {**source, bias: own[bias]}
  if weight in source:
    merged[weight] = _merged(own[weight], source[weight], tasks, source_tasks)
  serialisation.load_module_state(module, merged, "discriminator")


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
