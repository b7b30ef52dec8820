"""Settings of each scheduler; `kind` chooses the class."""

from typing import Annotated, Literal

from pydantic import Field

from lfgp_dmc.agents.fields import (
  Positive,
  PositiveInt,
  PositiveShare,
  Share,
  checked,
)


@checked
class _Periods:
  xi: PositiveInt = 45  # steps a choice


@checked
class QTableConfig(_Periods):
  """Learned (the paper's LfGP)."""

  kind: Literal["q_table"] = "q_table"
  phi: Share = 0.6  # weight of a new return
  temperature: Positive = 360.0  # at first, in units of the return
  decay: PositiveShare = 0.9995  # of the temperature, a choice
  minimum: Positive = 0.1  # lowest temperature


@checked
class WeightedRandomConfig(_Periods):
  """The main task with `main_weight`, the rest equal."""

  kind: Literal["weighted_random"] = "weighted_random"
  main_weight: Share = 0.5


@checked
class HandcraftedConfig(_Periods):
  """The same, mixed with fixed sequences."""

  kind: Literal["weighted_random_handcrafted"] = "weighted_random_handcrafted"
  main_weight: Share = 0.5
  probability: Share = 0.5  # of a sequence, an episode


@checked
class ConditionalConfig(_Periods):
  """The next task given the last (the paper's SAC-X experts)."""

  kind: Literal["conditional_weighted"] = "conditional_weighted"


@checked
class MainOnlyConfig(_Periods):
  """LfGP-NS, and single-task methods."""

  kind: Literal["main_only"] = "main_only"


@checked
class UniformConfig(_Periods):
  """Every task alike."""

  kind: Literal["uniform"] = "uniform"


SchedulerConfig = (
  QTableConfig
  | WeightedRandomConfig
  | HandcraftedConfig
  | ConditionalConfig
  | MainOnlyConfig
  | UniformConfig
)
AnyScheduler = Annotated[SchedulerConfig, Field(discriminator="kind")]
