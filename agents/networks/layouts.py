"""Which layers the tasks share: two layouts of the same modules.

`shared_trunk` (the multitask networks of the paper): O -> H -> H for all tasks,
for intentions and critics; each head adds a layer of H. `separate` (its
single-task networks): no trunk, each head has two layers of H of its own: with
K = 1 the intention is O-H-H-2A, each critic (O + A)-H-H-1.
"""

from collections.abc import Sequence

import torch
from torch import nn

from lfgp_dmc.agents.networks.critics import CriticNetwork, TwinCriticHeads
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.intentions import IntentionHeads, IntentionNetwork
from lfgp_dmc.agents.networks.trunk import Selection, Standardiser, Trunk

SEPARATE = "separate"


def make_intentions(
  layout: str,
  standardiser: Standardiser,
  tasks: int,
  hidden: int,
  actions: int,
  generator: torch.Generator,
  critics_trunk: nn.Module | None = None,
  encoder: Encoder | None = None,
) -> IntentionNetwork:
  """Draws K intentions, with a trunk of their own or the critics'."""
  inputs = standardiser.input_size
  trunk = critics_trunk or _make_trunk(layout, inputs, hidden, generator)
  features, layers = _of_heads(layout, inputs, hidden)
  heads = IntentionHeads(tasks, features, hidden, actions, generator, layers)
  owns_trunk = critics_trunk is None
  return IntentionNetwork(standardiser, trunk, heads, owns_trunk, encoder)


def make_critics(
  layout: str,
  inputs: int,
  tasks: int,
  hidden: int,
  actions: int,
  generator: torch.Generator,
  layer_norm: bool = False,
  masked: Sequence[int] = (),
  revealed: Sequence[int] = (),
) -> CriticNetwork:
  """Draws 2K critics, which do not see the `masked` inputs.

  Nor do they see the `revealed` ones until `reveal`; there, in the separate
  layout, they start from weights of 0.

  Raises:
    ValueError: nothing is left to see.
  """
  selection = Selection(inputs, masked, revealed)
  if not selection.size:
    raise ValueError("critic.masked hides all that critics see")
  trunk = _make_trunk(layout, selection.size, hidden, generator)
  if not selection.sees_all or selection.reveals:
    trunk = nn.Sequential(selection, trunk)
  features, layers = _of_heads(layout, selection.size, hidden)
  heads = TwinCriticHeads(
    tasks, features, hidden, actions, generator, layer_norm, layers
  )
  critics = CriticNetwork(trunk, heads)
  critics.forget_hidden()
  return critics


def _make_trunk(
  layout: str, inputs: int, hidden: int, generator: torch.Generator
) -> nn.Module:
  if layout == SEPARATE:
    return nn.Identity()
  return Trunk(inputs, hidden, generator)


def _of_heads(layout: str, inputs: int, hidden: int) -> tuple[int, int]:
  """A head's inputs, and its hidden layers."""
  return (inputs, 2) if layout == SEPARATE else (hidden, 1)
