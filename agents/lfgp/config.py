"""Every setting of the LfGP agent, checked when it is made."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from agents import cloning, field_checks, rewards, schedulers
from agents.networks import discriminator, layouts

ACTOR_TRUNKS = ("shared", "own")
MIXINGS = ("float", "row")  # of replay and expert rows, for the penalty
# Where rewards come from: the discriminators; the replay, which stores dense
# rewards (SAC-X); examples of success, +1 for a task's own and -1 for all else.
REWARD_SOURCES = ("discriminator", "replay", "examples")


@dataclasses.dataclass(frozen=True, kw_only=True)
class LfgpConfig:
  """Defaults are the paper's hyper-parameter table for AIL algorithms."""

  # Loop, in environment steps.
  warm_up: int = 1000  # transitions before the first update
  random_steps: int = 1000  # first steps with actions from U[-1, 1]
  updates_per_step: float = 1.0  # the training loop holds this ratio
  episode_steps: int = 360  # sets the scheduler's choices an episode

  # Networks.
  hidden_size: int = 256
  layout: str = layouts.SHARED_TRUNK  # "separate": each head its own (DAC)
  actor_trunk: str = "shared"  # "own": a second trunk, trained by the policy
  critic_layer_norm: bool = False
  standardise: bool = False  # inputs by the demonstrations' mean, deviation
  deviation_floor: float = 0.01  # smallest deviation, in the input's unit
  fine_scale: float = 0.0  # c of inputs tanh(x / c) beside x (m); 0: none
  absorbing_flag: bool = False  # a last input, 0: no state is absorbing here
  bfloat16: bool = False  # products in bfloat16; parameters stay float32
  cuda_graphs: bool = True  # on a GPU: updates recorded, then replayed

  # Intentions and critics.
  batch_size: int = 256
  discount: float = 0.99  # gamma, a step
  polyak: float = 0.005  # share of the online network
  critic_learning_rate: float = 3e-4
  intention_learning_rate: float = 1e-5
  temperature_learning_rate: float = 3e-4
  initial_temperature: float = 1.0  # alpha
  target_entropy: float = -4.0  # nats
  max_gradient_norm: float = 10.0  # critics, intentions, log alpha apart
  weight_decay: float = 0.0  # above 0: AdamW, on all but alpha
  value_penalty: float = 0.0  # lambda of values out of bounds (later work: 10)
  value_penalty_window: int = 50  # updates that the bounds' medians run over
  freeze_updates: int = 0  # first updates, with the intentions' trunk frozen
  intention_delay: int = 0  # first updates, of critics and discriminators alone

  # Rewards.
  reward_source: str = "discriminator"  # or "replay", "examples"
  reward: str = "logit"  # of discriminators; see agents/rewards.py
  reward_clip: float = 0.0  # bound on |reward| before scaling; 0: none
  reward_scale: float = 1.0  # later work, with examples: 0.1
  example_share: float = 0.5  # of the critics' batch, if rewards are examples'
  example_noise: float = 0.1  # on examples, in the demonstrations' deviations

  # Discriminators.
  discriminator_learning_rate: float = 3e-4
  discriminator_batch_size: int = 256  # expert pairs a task
  discriminator_input: str = "state_action"  # or "state"
  discriminator_unseen: str = ""  # of an observation, such as 3:6,53:59
  # If any, the main task has a discriminator of its own that does not see these
  # (instead of those above).
  main_discriminator_unseen: str = ""
  discriminator_noise: float = 0.0  # on observations, in deviations
  discriminator_every: int = 1  # updates between its updates
  discriminator_final_share: float = 0.0  # of expert pairs, rows of success
  final_rows: int = 1  # last rows of an attempt that are rows of success
  gradient_penalty: float = 10.0  # lambda
  gradient_penalty_per_task: bool = False
  gradient_penalty_mixing: str = "float"  # a share for each; "row": one for all

  # Scheduler.
  scheduler: str = "q_table"
  xi: int = 45  # steps a choice
  scheduler_phi: float = 0.6
  scheduler_temperature: float = 360.0
  scheduler_decay: float = 0.9995
  scheduler_minimum: float = 0.1
  main_weight: float = 0.5  # weighted random: the main task's
  handcrafted_probability: float = 0.5

  # Use of demonstrations beyond the discriminators.
  expert_share: float = 0.0  # of the critics' and intentions' batch
  expert_share_decay: float = 1.0  # factor an update
  main_expert_share: float = 0.0  # of these, the main task's; 0: like any other
  intentions_on_experts: bool = True  # or critics alone learn from such rows
  translation_reach: float = 0.0  # m, shift of expert rows, where no slot pins
  bc_loss: str = cloning.SQUARED_ERROR  # or "likelihood"; prior: divergence
  bc_weight: float = 0.0  # BC term in the intentions' loss
  bc_normalise: bool = False  # times each task's mean |Q|
  bc_decay: float = 1.0  # factor on the weight an update
  prior_weight: float = 0.0  # stay near the first intentions, on all rows
  bc_warm_start_updates: int = 0  # pure BC before the first step
  bc_learning_rate: float = 3e-4  # of the warm start; falls to 0, a cosine
  cloned_deviation: float = 0.0  # after it; 0: 0.7, or what was cloned

  # Other runs.
  init_from: str = ""  # policy folder whose intentions the actor starts from
  transfer_updates: int = 1000  # before the first step, if a task is new

  def __post_init__(self):
    """Raises ValueError that lists every field out of its range."""
    faults = field_checks.faults(self, _RANGES, _CHOICES)
    if self.discriminator_noise and not self.standardise:
      faults.append(
        f"discriminator_noise is {self.discriminator_noise!r}; valid: 0 "
        "unless standardise is True (its unit is the standardised input's)"
      )
    if self.init_from and self.bc_warm_start_updates:
      faults.append(
        f"init_from is {self.init_from!r}; valid: nothing, if there are "
        "bc_warm_start_updates"
      )
    if not faults:
      faults = self._reward_faults()
    if faults:
      raise ValueError(f"LfgpConfig: {'; '.join(faults)}")

  def _reward_faults(self) -> list[str]:
    """What does not go together with the source of rewards."""
    source, faults = self.reward_source, []
    if source != "discriminator" and self.expert_share:
      faults.append(
        f"expert_share is {self.expert_share!r}; valid: 0 unless reward_source "
        "is discriminator (expert rows have no other reward)"
      )
    if source != "examples":
      return faults
    if self.scheduler == "q_table":
      faults.append(
        "scheduler is 'q_table'; valid: another, if reward_source is examples "
        "(whatever is done earns -1)"
      )
    rows = int(self.example_share * self.batch_size)
    if not 0 < rows < self.batch_size:
      faults.append(
        f"example_share is {self.example_share!r}; valid: one that puts some "
        "of batch_size rows on either side"
      )
    return faults

  @property
  def uses_demonstrations(self) -> bool:
    """Whether there is anything to do with demonstrations."""
    return (
      self.reward_source != "replay"
      or self.bc_weight > 0
      or self.bc_warm_start_updates > 0
      or self.standardise
    )

  @property
  def keeps_rewards(self) -> bool:
    """Whether the replay has to keep dense rewards."""
    return self.reward_source == "replay"

  @property
  def owns_trunk(self) -> bool:
    """Whether the intentions have a trunk apart from the critics'.

    They do if asked for, and if they start from cloned behaviour, which the
    critics' loss would undo; unless the common trunk is frozen at first.
    """
    is_cloned = self.bc_warm_start_updates > 0 or bool(self.init_from)
    return self.actor_trunk == "own" or (is_cloned and self.freeze_updates == 0)

  @classmethod
  def from_mapping(cls, values: Mapping[str, Any]) -> "LfgpConfig":
    """Makes a config from field names and values.

    Raises:
      ValueError: a name is no field, or a value is out of its range.
    """
    names = {field.name for field in dataclasses.fields(cls)}
    unknown = sorted(set(values) - names)
    if unknown:
      raise ValueError(
        f"LfgpConfig has no {', '.join(unknown)}; valid: "
        f"{', '.join(sorted(names))}"
      )
    return cls(**values)


_INTEGERS_ABOVE_0 = (
  "warm_up episode_steps hidden_size batch_size xi final_rows "
  "discriminator_batch_size discriminator_every value_penalty_window"
)
_NUMBERS_ABOVE_0 = (
  "updates_per_step deviation_floor critic_learning_rate "
  "intention_learning_rate temperature_learning_rate initial_temperature "
  "max_gradient_norm reward_scale discriminator_learning_rate "
  "bc_learning_rate scheduler_temperature scheduler_minimum"
)
_NUMBERS_FROM_0 = (
  "weight_decay discriminator_noise gradient_penalty reward_clip bc_weight "
  "value_penalty example_noise fine_scale prior_weight "
  "cloned_deviation translation_reach"
)
_SHARES = (
  "discount discriminator_final_share expert_share expert_share_decay "
  "bc_decay scheduler_phi main_weight handcrafted_probability example_share "
  "main_expert_share"
)
_SWITCHES = (
  "critic_layer_norm standardise bfloat16 cuda_graphs bc_normalise "
  "gradient_penalty_per_task absorbing_flag intentions_on_experts"
)
# What is valid -> names of fields; see `field_checks.py`.
_RANGES = {
  "an integer above 0": _INTEGERS_ABOVE_0,
  "an integer, 0 or more": "random_steps bc_warm_start_updates "
  "freeze_updates intention_delay transfer_updates",
  "a number above 0": _NUMBERS_ABOVE_0,
  "a number, 0 or more": _NUMBERS_FROM_0,
  "a number": "target_entropy",
  "a number from 0 to 1": _SHARES,
  "a number above 0, at most 1": "polyak scheduler_decay",
  "True or False": _SWITCHES,
  "a folder's name, or nothing": "init_from",
  "slices of an observation, such as 3:6,53:59": "discriminator_unseen "
  "main_discriminator_unseen",
}
_CHOICES: dict[str, tuple[str, ...]] = {
  "actor_trunk": ACTOR_TRUNKS,
  "bc_loss": cloning.LOSSES,
  "discriminator_input": discriminator.INPUTS,
  "gradient_penalty_mixing": MIXINGS,
  "layout": layouts.LAYOUTS,
  "reward": tuple(rewards.VARIANTS),
  "reward_source": REWARD_SOURCES,
  "scheduler": schedulers.NAMES,
}
