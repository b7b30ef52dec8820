"""Floating-point operations that one update needs, by a fixed formula.

What the plain equations ask for, 2 operations a multiply-add, whatever an
implementation does or saves: a backward pass costs twice its forward pass (an
input gradient alone once), and the gradient penalty, itself differentiated
twice, six times its forward pass.
"""

from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.agents.lfgp.config import DiscriminatorReward
from lfgp_dmc.agents.networks import layouts


def gflop_of_update(
  config: LfgpConfig, tasks: int, observations: int, actions: int
) -> dict[str, float]:
  """The terms of one update of K tasks, in GFLOP; their sum is its need."""
  hidden, rows = config.networks.hidden_size, config.batch_size
  shared = observations * hidden + hidden * hidden
  if config.networks.layout == layouts.SEPARATE:
    trunk, before = 0, shared  # each head has these layers itself
  else:
    trunk, before = shared, hidden * hidden
  intention = before + hidden * 2 * actions
  critic = before + actions * hidden + hidden

  def gflop(multiplications: float, count: int) -> float:
    return 2e-9 * multiplications * count

  terms = {
    "trunk": gflop(trunk, 3 * rows),
    "trunk_next": gflop(trunk, 2 * rows),
    "intentions_next": gflop(intention, tasks * rows),
    "target_critics": gflop(critic, 2 * tasks * rows),
    "critics": gflop(critic, 3 * 2 * tasks * rows),
    "intentions": gflop(intention, 3 * tasks * rows),
    "critics_of_intentions": gflop(critic, 2 * 2 * tasks * rows),
  }
  if isinstance(config.reward, DiscriminatorReward):
    seen = observations
    if config.reward.input == "state_action":
      seen += actions
    discriminator = seen * hidden + hidden * hidden + hidden * tasks
    mixed = tasks * config.reward.batch_size
    terms["discriminator"] = gflop(discriminator, 3 * (rows + mixed))
    terms["gradient_penalty"] = gflop(discriminator, 6 * mixed)
  return terms
