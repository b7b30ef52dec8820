"""Every setting of the LfGP agent, in the groups that its parts take.

Defaults are the paper's hyper-parameter table for AIL algorithms.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from lfgp_dmc.agents.fields import (
  Count,
  InputsConfig,
  NetworksConfig,
  NonNegative,
  OptimiserConfig,
  Positive,
  PositiveInt,
  PositiveShare,
  Real,
  Share,
  Slices,
  Switch,
  checked,
  positions,
)
from lfgp_dmc.agents.schedulers.config import AnyScheduler, QTableConfig


@checked
class LfgpNetworksConfig(NetworksConfig):
  """Sizes and options of intentions and critics."""

  # "own": a second trunk, trained by the policy loss; else it is the critics'.
  actor_trunk: Literal["shared", "own"] = "shared"
  critic_layer_norm: Switch = False


@checked
class CriticConfig:
  """Values, and bounds on them."""

  learning_rate: Positive = 3e-4
  discount: Share = 0.99  # gamma, a step
  polyak: PositiveShare = 0.005  # share of the online network
  warmup_updates: Count = 0  # first updates, without the intentions
  # What critics do not see of an observation, such as 3:6,53:59: of few rows
  # they learn by heart whose return was high.
  masked: Slices = ""
  # What they see only after so many updates: floats that tell failed tries
  # apart keep those from being valued before any has succeeded.
  revealed: Slices = ""
  revealed_after: Count = 0
  value_penalty: NonNegative = 0.0  # lambda, on values out of bounds
  value_penalty_window: PositiveInt = 50  # updates of the bounds' medians


@checked
class IntentionConfig:
  """Policies and their temperatures."""

  learning_rate: Positive = 1e-5
  temperature_learning_rate: Positive = 3e-4
  initial_temperature: Positive = 1.0  # alpha
  target_entropy: Real = -4.0  # nats


@checked
class DiscriminatorReward:
  """Rewards from discriminators of expert and policy."""

  kind: Literal["discriminator"] = "discriminator"
  form: Literal["logit", "probability", "gail", "log_probability"] = "logit"
  clip: NonNegative = 0.0  # bound on |reward| before scaling; 0: none
  scale: Positive = 1.0
  learning_rate: Positive = 3e-4
  batch_size: PositiveInt = 256  # expert pairs a task
  input: Literal["state_action", "state"] = "state_action"
  masked: Slices = ""  # of an observation, such as 3:6,53:59
  # If set, the main task gets its own discriminator with these masked instead.
  main_masked: Slices = ""
  noise: NonNegative = 0.0  # on standardised observations
  every: PositiveInt = 1  # updates between its updates
  final_share: Share = 0.0  # of expert pairs, rows of success
  gradient_penalty: NonNegative = 10.0  # lambda
  gradient_penalty_per_task: Switch = False
  # Expert rows among those of critics and intentions.
  expert_share: Share = 0.0
  expert_share_decay: Share = 1.0  # factor an update
  main_expert_share: Share = 0.0  # of these, the main task's; 0: an equal one
  intentions_on_experts: Switch = True  # or critics alone learn from them


@checked
class StoredReward:
  """Dense rewards that the replay stores (SAC-X)."""

  kind: Literal["stored"] = "stored"
  clip: NonNegative = 0.0  # bound on |reward| before scaling; 0: none
  scale: Positive = 1.0


@checked
class ExampleReward:
  """+1 for a task's own examples of success, -1 for all else."""

  kind: Literal["examples"] = "examples"
  scale: Positive = 1.0  # the authors' later work: 0.1
  share: Share = 0.5  # of the critics' batch
  noise: NonNegative = 0.1  # on examples, in the demonstrations' std


RewardConfig = DiscriminatorReward | StoredReward | ExampleReward


@checked
class PretrainingConfig:
  """Behaviour cloning before the first step."""

  updates: Count = 0
  learning_rate: Positive = 3e-4  # falls to 0, a cosine
  loss: Literal["squared_error", "likelihood"] = "squared_error"
  std: NonNegative = 0.0  # of the cloned intentions; 0: as it comes out


@checked
class PriorConfig:
  """Regularises intentions towards the first ones, on replayed rows."""

  weight: NonNegative = 0.0
  distance: Literal["squared_error", "divergence"] = "squared_error"
  normalise: Switch = False  # times each task's mean |Q|
  decay: Share = 1.0  # factor on the weight, an update


@checked
class LfgpConfig:
  """LfGP; LfGP-NS, DAC and SAC-X are settings of it."""

  batch_size: PositiveInt = 256
  final_rows: PositiveInt = 1  # last rows of an attempt that are of success
  inputs: InputsConfig = InputsConfig()
  networks: LfgpNetworksConfig = LfgpNetworksConfig()
  optimiser: OptimiserConfig = OptimiserConfig()
  critic: CriticConfig = CriticConfig()
  intention: IntentionConfig = IntentionConfig()
  reward: Annotated[RewardConfig, Field(discriminator="kind")] = (
    DiscriminatorReward()
  )
  scheduler: AnyScheduler = QTableConfig()
  pretraining: PretrainingConfig = PretrainingConfig()
  prior: PriorConfig = PriorConfig()

  @model_validator(mode="after")
  def _check_groups(self):
    """Raises ValueError that lists what does not go together."""
    faults = [*self._reward_faults(), *self._critic_faults()]
    if self.pretraining.updates and self.shares_trunk:
      faults.append(
        "networks.actor_trunk is 'shared'; valid: own, if there are "
        "pretraining.updates (the critics' loss would undo them)"
      )
    if faults:
      raise ValueError("\n".join(faults))
    return self

  def _critic_faults(self):
    critic = self.critic
    if critic.masked and self.shares_trunk:
      yield (
        f"critic.masked is {critic.masked!r}; valid: nothing, if "
        "networks.actor_trunk is 'shared' (intentions see what critics see)"
      )
    if critic.revealed and self.networks.layout != "separate":
      yield (
        f"critic.revealed is {critic.revealed!r}; valid: nothing, unless "
        "networks.layout is 'separate'"
      )
    if {*positions(critic.revealed)} & {*positions(critic.masked)}:
      yield (
        f"critic.revealed is {critic.revealed!r}; valid: what critic.masked "
        f"({critic.masked}) leaves"
      )
    if bool(critic.revealed) != bool(critic.revealed_after):
      yield (
        f"critic.revealed_after is {critic.revealed_after}; valid: a count of "
        f"updates if critic.revealed ({critic.revealed!r}) is set, else 0"
      )

  def _reward_faults(self):
    reward = self.reward
    if isinstance(reward, DiscriminatorReward):
      if reward.noise and not self.inputs.standardise:
        yield (
          f"reward.noise is {reward.noise!r}; valid: 0 unless "
          "inputs.standardise is True (its unit is the standardised input's)"
        )
      experts = int(reward.expert_share * self.batch_size)
      if experts == self.batch_size and not reward.intentions_on_experts:
        yield (
          f"reward.expert_share is {reward.expert_share!r}; valid: one that "
          "leaves rows for the intentions, unless "
          "reward.intentions_on_experts is True"
        )
      if reward.expert_share and not experts:
        yield (
          f"reward.expert_share is {reward.expert_share!r}; valid: 0, or what "
          f"makes a row of batch_size, {self.batch_size}"
        )
      if reward.main_expert_share and not reward.expert_share:
        yield (
          f"reward.main_expert_share is {reward.main_expert_share!r}; valid: 0 "
          "without reward.expert_share"
        )
      if reward.final_share and int(reward.final_share * reward.batch_size) < 1:
        yield (
          f"reward.final_share is {reward.final_share!r}; valid: 0, or what "
          f"makes a row of reward.batch_size, {reward.batch_size}"
        )
    elif isinstance(reward, ExampleReward):
      if self.scheduler.kind == "q_table":
        yield (
          "scheduler.kind is 'q_table'; valid: another, if reward.kind is "
          "examples (whatever is done earns -1)"
        )
      if not 0 < int(reward.share * self.batch_size) < self.batch_size:
        yield (
          f"reward.share is {reward.share!r}; valid: one that puts some of "
          "batch_size rows on either side"
        )

  @property
  def shares_trunk(self) -> bool:
    """Whether critics and intentions have a trunk in common."""
    networks = self.networks
    has_trunk = networks.layout == "shared_trunk"
    return has_trunk and networks.actor_trunk == "shared"

  @property
  def uses_demonstrations(self) -> bool:
    """Whether demonstrations are needed."""
    return (
      not self.keeps_rewards
      or self.pretraining.updates > 0
      or self.inputs.standardise
    )

  @property
  def keeps_rewards(self) -> bool:
    """Whether the replay must store dense rewards."""
    return isinstance(self.reward, StoredReward)
