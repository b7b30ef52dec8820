"""Constraints of configs' fields, and groups of fields that agents share.

A config is a frozen dataclass of groups; pydantic checks each field, strictly,
where it is declared.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar, dataclass_transform

import numpy as np
import pydantic
import pydantic.dataclasses
from pydantic import AfterValidator, ConfigDict, Field

_Config = TypeVar("_Config")
_SAYS = "Input should be "  # how pydantic starts what is valid

PositiveInt = Annotated[int, Field(strict=True, ge=1)]
Count = Annotated[int, Field(strict=True, ge=0)]
Processes = Annotated[Count, Field(le=4096)]  # or threads
Real = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Real, Field(gt=0)]
NonNegative = Annotated[Real, Field(ge=0)]
Share = Annotated[Real, Field(ge=0, le=1)]
PositiveShare = Annotated[Real, Field(gt=0, le=1)]
ProperShare = Annotated[Real, Field(gt=0, lt=1)]
Switch = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True)]


@dataclass_transform(kw_only_default=True, frozen_default=True)
def checked(kind: type[_Config]) -> type[_Config]:
  """Makes a class a frozen, checked dataclass that refuses unknown fields."""
  made: Any = pydantic.dataclasses.dataclass(
    kind, frozen=True, kw_only=True, config=ConfigDict(extra="forbid")
  )
  return made


def faults(
  error: pydantic.ValidationError, values: Mapping[str, Any], prefix: str
) -> list[str]:
  """What is wrong, such as "config.agent.scheduler.xi is 0; valid: ...".

  Of a `checked` class made of `values`, whose names get the prefix.
  """
  return [_fault(fault, values, prefix) for fault in error.errors()]


def _fault(fault: Any, values: Mapping[str, Any], prefix: str) -> str:
  says = fault["msg"].removeprefix("Value error, ").removeprefix(_SAYS)
  if not fault["loc"]:  # of fields together: they are named already
    return "\n".join(f"{prefix}.{line}" for line in says.split("\n"))
  name, within = prefix, values
  for part in fault["loc"]:
    if part in within:  # else the kind of a group
      name, within = f"{name}.{part}", within[part]
      within = within if isinstance(within, Mapping) else {}
  match fault["type"]:
    case "missing":
      return f"{name}.{fault['loc'][-1]} is missing"
    case "unexpected_keyword_argument":
      return f"unknown {name}"
    case "union_tag_invalid":
      tag, tags = fault["ctx"]["tag"], fault["ctx"]["expected_tags"]
      return f"{name}.kind is {tag!r}; valid: {tags}"
  return f"{name} is {fault['input']!r}; valid: {says}"


def check_arrays(
  arrays: Mapping[str, np.ndarray],
  shapes: Mapping[str, tuple[int, ...]],
  what: str,
) -> None:
  """Checks that stored arrays are those of these names and shapes, and finite.

  Raises:
    ValueError: the message starts with `what` and lists each fault.
  """
  found = [f"{name} is missing" for name in shapes if name not in arrays]
  found += [f"{name} is not known" for name in arrays if name not in shapes]
  for name, shape in shapes.items():
    array = arrays.get(name)
    if array is not None and tuple(array.shape) != shape:
      found.append(f"{name} has shape {list(array.shape)}, not {list(shape)}")
    elif array is not None and not np.isfinite(array).all():
      found.append(f"{name} holds numbers that are not finite")
  if found:
    raise ValueError(f"{what}: {'; '.join(found)}")


def positions(slices: str) -> tuple[int, ...]:
  """The indices that slices such as "3:6,53:59" name.

  Raises:
    ValueError: not START:STOP, with commas between.
  """
  found: list[int] = []
  for part in filter(None, slices.split(",")):
    start, _, stop = part.partition(":")
    if not (start.isdecimal() and stop.isdecimal() and int(start) < int(stop)):
      raise ValueError("slices of an observation, such as 3:6,53:59")
    found += range(int(start), int(stop))
  return tuple(found)


def _checked_slices(slices: str) -> str:
  positions(slices)
  return slices


Slices = Annotated[Text, AfterValidator(_checked_slices)]


@checked
class InputsConfig:
  """What networks see of an observation."""

  standardise: Switch = False  # by the demonstrations' mean and std
  tanh_feature_scale: NonNegative = (
    0.0  # c of tanh(x / c) beside x (m); 0: none
  )


@checked
class NetworksConfig:
  """Sizes; see `networks/layouts.py`."""

  hidden_size: PositiveInt = 256
  layout: Literal["shared_trunk", "separate"] = "shared_trunk"


@checked
class OptimiserConfig:
  """What gradient steps have in common."""

  weight_decay: NonNegative = 0.0  # above 0: AdamW
  # Of each part; 0: none. Discriminators have none, as in the released code.
  max_gradient_norm: NonNegative = 10.0
