"""Which layers the tasks share: two layouts of the same modules.

`shared_trunk` (the multitask networks of the paper): O -> H -> H for all tasks,
for intentions and critics; each head adds a layer of H. `separate` (its
single-task networks): no trunk, each head has two layers of H of its own: with
K = 1 the intention is O-H-H-2A, each critic (O + A)-H-H-1.
"""

import torch
from torch import nn

from lfgp_dmc.agents.networks.critics import TwinCriticHeads
from lfgp_dmc.agents.networks.intentions import IntentionHeads
from lfgp_dmc.agents.networks.trunk import Trunk

SHARED_TRUNK, SEPARATE = "shared_trunk", "separate"
LAYOUTS = (SHARED_TRUNK, SEPARATE)


def make_trunk(
  layout: str, observations: int, hidden: int, generator: torch.Generator
) -> nn.Module:
  """The layers before the heads: inputs [..., O] -> features [..., O or H].

  Args:
    layout: a name in `LAYOUTS`.
    observations: O.
    hidden: H.
    generator: source of the initial numbers.
  """
  if layout == SEPARATE:
    return nn.Identity()
  return Trunk(observations, hidden, generator)


def make_intention_heads(
  layout: str,
  tasks: int,
  observations: int,
  hidden: int,
  actions: int,
  generator: torch.Generator,
) -> IntentionHeads:
  """The K heads that fit `make_trunk`'s features; arguments likewise."""
  features, layers = _of_heads(layout, observations, hidden)
  return IntentionHeads(tasks, features, hidden, actions, generator, layers)


def make_critic_heads(
  layout: str,
  tasks: int,
  observations: int,
  hidden: int,
  actions: int,
  generator: torch.Generator,
  layer_norm: bool = False,
) -> TwinCriticHeads:
  """The 2K heads that fit `make_trunk`'s features; arguments likewise."""
  features, layers = _of_heads(layout, observations, hidden)
  return TwinCriticHeads(
    tasks, features, hidden, actions, generator, layer_norm, layers
  )


def layout_of(heads: IntentionHeads) -> str:
  """The layout that `make_intention_heads` made these heads for."""
  return SHARED_TRUNK if heads.second is None else SEPARATE


def _of_heads(layout: str, observations: int, hidden: int) -> tuple[int, int]:
  """A head's inputs, and its hidden layers."""
  return (observations, 2) if layout == SEPARATE else (hidden, 1)
