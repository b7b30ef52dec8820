"""All networks of the LfGP learner, drawn from one generator."""

import copy
import dataclasses
from typing import TypeVar

import torch
from torch import nn

from lfgp_dmc.agents import field_checks
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.critics import CriticNetwork
from lfgp_dmc.agents.networks.discriminator import Discriminator
from lfgp_dmc.agents.networks.intentions import IntentionNetwork
from lfgp_dmc.agents.networks.trunk import Standardiser

_Network = TypeVar("_Network", bound=nn.Module)


@dataclasses.dataclass
class LfgpNetworks:
  """What the learner trains; with a shared trunk, intentions' = critics'."""

  intentions: IntentionNetwork
  critics: CriticNetwork
  target_critics: CriticNetwork  # a copy, trunk and heads, without gradient
  # Of all tasks, or of all but the main task; None: no reward comes from it.
  discriminator: Discriminator | None
  log_temperature: nn.Parameter  # [K]
  prior: IntentionNetwork | None = None  # the first intentions, frozen
  main_discriminator: Discriminator | None = None  # the main task's, if apart

  def modules(self) -> dict[str, nn.Module]:
    """The modules by the names used in checkpoints."""
    modules: dict[str, nn.Module] = {
      "intentions": self.intentions,
      "critics": self.critics,
      "target_critics": self.target_critics,
    }
    if self.discriminator is not None:
      modules["discriminator"] = self.discriminator
    if self.main_discriminator is not None:
      modules["main_discriminator"] = self.main_discriminator
    if self.prior is not None:
      modules["prior"] = self.prior
    return modules


def make_networks(
  config: LfgpConfig,
  tasks: int,
  actions: int,
  standardiser: Standardiser,
  generator: torch.Generator,
  device: torch.device,
) -> LfgpNetworks:
  """Draws all networks.

  Args:
    config: sizes and options.
    tasks: K.
    actions: A.
    standardiser: raw observation -> input; O is its input size.
    generator: a CPU generator, source of the initial numbers.
    device: where to put the networks.

  Returns:
    The networks; see `LfgpConfig.owns_trunk`.
  """
  layout, hidden = config.layout, config.hidden_size
  observations = standardiser.input_size
  sizes = (tasks, observations, hidden, actions)
  trunk = layouts.make_trunk(layout, observations, hidden, generator)
  critics = CriticNetwork(
    trunk,
    layouts.make_critic_heads(
      layout, *sizes, generator, config.critic_layer_norm
    ),
  ).to(device)
  own = trunk
  if config.owns_trunk:
    own = layouts.make_trunk(layout, observations, hidden, generator)
  intentions = IntentionNetwork(
    standardiser,
    own,
    layouts.make_intention_heads(layout, *sizes, generator),
    config.owns_trunk,
  ).to(device)
  main_discriminator, discriminator = _make_discriminators(
    config, tasks, actions, standardiser, generator, device
  )
  initial = torch.tensor(config.initial_temperature).log()
  return LfgpNetworks(
    intentions=intentions,
    critics=critics,
    target_critics=_frozen_copy(critics),
    discriminator=discriminator,
    log_temperature=nn.Parameter(initial.repeat(tasks).to(device)),
    prior=_frozen_copy(intentions) if config.prior_weight else None,
    main_discriminator=main_discriminator,
  )


def _make_discriminators(
  config: LfgpConfig,
  tasks: int,
  actions: int,
  standardiser: Standardiser,
  generator: torch.Generator,
  device: torch.device,
) -> tuple[Discriminator | None, Discriminator | None]:
  """The main task's own, if it has one, and that of all other tasks."""
  if config.reward_source != "discriminator":
    return None, None

  def make(count: int, unseen: str) -> Discriminator:
    return Discriminator(
      count,
      standardiser.input_size,
      actions,
      config.hidden_size,
      generator,
      config.discriminator_input,
      unseen_inputs(unseen, standardiser),
    ).to(device)

  if not config.main_discriminator_unseen:
    return None, make(tasks, config.discriminator_unseen)
  if tasks == 1:  # there are no others to be apart from
    return None, make(1, config.main_discriminator_unseen)
  main = make(1, config.main_discriminator_unseen)
  return main, make(tasks - 1, config.discriminator_unseen)


def unseen_inputs(slices: str, standardiser: Standardiser) -> list[int]:
  """Which network inputs stand for some floats of the observation.

  Args:
    slices: of the observation, such as "3:6,53:59".
    standardiser: what makes inputs of it, at one scale or two.

  Raises:
    ValueError: the observation has fewer floats.
  """
  size = len(standardiser.mean)
  chosen = field_checks.positions(slices)
  if chosen and max(chosen) >= size:
    raise ValueError(
      f"unseen by a discriminator is {slices}; the observation has {size} "
      "floats"
    )
  scales = 2 if standardiser.fine_scale else 1
  return [scale * size + at for scale in range(scales) for at in chosen]


def _frozen_copy(network: _Network) -> _Network:
  return copy.deepcopy(network).requires_grad_(False)
