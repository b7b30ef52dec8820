"""All networks of the LfGP learner, drawn from one generator."""

import copy
import dataclasses
from typing import NamedTuple, TypeVar

import torch
from torch import nn

from lfgp_dmc.agents import fields
from lfgp_dmc.agents.fields import OptimiserConfig
from lfgp_dmc.agents.lfgp.config import DiscriminatorReward, LfgpConfig
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.critics import CriticNetwork
from lfgp_dmc.agents.networks.discriminator import Discriminator
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.flat import FlatModule
from lfgp_dmc.agents.networks.intentions import IntentionNetwork
from lfgp_dmc.agents.networks.trunk import Standardiser

_Network = TypeVar("_Network", bound=nn.Module)


@dataclasses.dataclass
class LfgpNetworks:
  """All networks; a shared trunk is one module in intentions and critics."""

  intentions: IntentionNetwork
  critics: CriticNetwork
  target_critics: CriticNetwork  # a copy, trunk and heads, without gradient
  log_temperature: nn.Parameter  # [K]
  main_discriminator: Discriminator | None = None  # the main task's own
  # Of all tasks, or of all but the main; None: no reward comes from it.
  discriminator: Discriminator | None = None
  prior: IntentionNetwork | None = None  # the first intentions, frozen

  def modules(self) -> dict[str, FlatModule]:
    """The modules by name, which checkpoints use."""
    fields = vars(self).items()
    return {k: part for k, part in fields if isinstance(part, FlatModule)}

  def flatten(self, dtype: torch.dtype) -> None:
    """Lays each network's parameters out flat, for products of the dtype."""
    for module in self.modules().values():
      module.flatten(dtype)

  def refresh(self) -> None:
    """After parameters were written to by other means than steps."""
    for module in self.modules().values():
      module.flat.refresh()


class Training(NamedTuple):
  """What all parts of an update have in common."""

  networks: LfgpNetworks
  optimiser: OptimiserConfig
  generator: torch.Generator
  dtype: torch.dtype


def make_networks(
  config: LfgpConfig,
  tasks: int,
  actions: int,
  standardiser: Standardiser,
  generator: torch.Generator,
  device: torch.device,
  encoder: Encoder | None = None,
) -> LfgpNetworks:
  """Draws all networks from a CPU generator; a given encoder goes along."""
  own = config.networks
  sizes = (tasks, own.hidden_size, actions, generator)
  critics = layouts.make_critics(
    own.layout,
    standardiser.input_size,
    *sizes,
    own.critic_layer_norm,
    inputs_of(config.critic.masked, standardiser),
    inputs_of(config.critic.revealed, standardiser),
  ).to(device)
  trunk = critics.trunk if config.shares_trunk else None
  intentions = layouts.make_intentions(
    own.layout, standardiser, *sizes, trunk, encoder
  ).to(device)
  initial = torch.tensor(config.intention.initial_temperature).log()
  networks = LfgpNetworks(
    intentions=intentions,
    critics=critics,
    target_critics=_frozen_copy(critics),
    log_temperature=nn.Parameter(initial.repeat(tasks).to(device)),
    prior=_frozen_copy(intentions) if config.prior.weight else None,
  )
  if networks.prior is not None:
    networks.prior.owns_trunk = True  # a copy
  reward = config.reward
  if not isinstance(reward, DiscriminatorReward):
    return networks

  def make(count: int, masked: str) -> Discriminator:
    sizes = count, standardiser.input_size, actions, own.hidden_size
    unseen = inputs_of(masked, standardiser)
    network = Discriminator(*sizes, generator, reward.input, unseen)
    return network.to(device)

  masked = reward.masked
  if reward.main_masked and tasks == 1:  # there are no others
    masked = reward.main_masked
  elif reward.main_masked:
    networks.main_discriminator = make(1, reward.main_masked)
    tasks -= 1
  networks.discriminator = make(tasks, masked)
  return networks


def inputs_of(slices: str, standardiser: Standardiser) -> list[int]:
  """Which network inputs stand for slices of an observation, as "3:6,53:59".

  Raises:
    ValueError: the observation has fewer floats.
  """
  size = len(standardiser.mean)
  chosen = fields.positions(slices)
  if chosen and max(chosen) >= size:
    raise ValueError(
      f"slices (critic.masked, critic.revealed, reward.masked or "
      f"reward.main_masked) are {slices}; the observation has {size} floats"
    )
  scales = standardiser.input_size // size
  return [scale * size + at for scale in range(scales) for at in chosen]


def _frozen_copy(network: _Network) -> _Network:
  return copy.deepcopy(network).requires_grad_(False)
