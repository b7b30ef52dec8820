"""From names and flags to a config: defaults, preset, overrides, checks."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import ml_collections

from lfgp_dmc.launch.configs.algorithms import ALGORITHMS
from lfgp_dmc.launch.configs.presets import PRESETS
from lfgp_dmc.launch.configs.run_config import RunConfig


def make_config(
  algorithm: str = "lfgp", preset: str = "paper"
) -> ml_collections.ConfigDict:
  """All fields of a run with their defaults, locked.

  Args:
    algorithm: a name in `ALGORITHMS`; it decides the fields of `agent`.
    preset: a name in `PRESETS`.

  Raises:
    ValueError: an unknown name; the message lists the valid ones.
  """
  for what, name, valid in (
    ("algorithm", algorithm, ALGORITHMS),
    ("preset", preset, PRESETS),
  ):
    if name not in valid:
      raise ValueError(f"unknown {what} {name!r}; valid: {', '.join(valid)}")
  agent = ALGORITHMS[algorithm].make_agent_config()
  own = ALGORITHMS[algorithm].run_defaults
  run = RunConfig(algorithm=algorithm, agent=agent, **own)
  config = ml_collections.ConfigDict(dataclasses.asdict(run)).lock()
  changes = dict(PRESETS[preset])
  # What makes the algorithm itself is not the preset's to change.
  for name in ALGORITHMS[algorithm].defaults:
    changes.pop(f"agent.{name}", None)
  known = {f"agent.{field.name}" for field in dataclasses.fields(agent)}
  config.update_from_flattened_dict(
    {
      name: value
      for name, value in changes.items()
      if name in known or not name.startswith("agent.")
    }
  )
  return config


def to_run_config(config: ml_collections.ConfigDict) -> RunConfig:
  """Checks a config and freezes it.

  Raises:
    ValueError: a value out of its range; one line a fault.
  """
  return from_dict(config.to_dict())


def from_dict(values: Mapping[str, Any]) -> RunConfig:
  """Reads a config back from nested values, such as a run's `config.json`.

  A field that is not there, since the run is older than it, has its default.

  Raises:
    ValueError: an unknown field, or a value out of its range.
  """
  name = values.get("algorithm")
  if name not in ALGORITHMS:
    raise ValueError(
      f"config.algorithm is {name!r}; valid: {', '.join(ALGORITHMS)}"
    )
  agent_values = values.get("agent")
  if not isinstance(agent_values, Mapping):
    raise ValueError(f"config.agent is {agent_values!r}; valid: its fields")
  algorithm = ALGORITHMS[name]
  _check_fields(RunConfig, values, "config")
  _check_fields(algorithm.agent_config, agent_values, "config.agent")
  try:
    agent = algorithm.agent_config(**{**algorithm.defaults, **agent_values})
  except ValueError as error:
    raise ValueError(f"config.agent: {error}") from None
  return RunConfig(**{**algorithm.run_defaults, **values, "agent": agent})


def _check_fields(kind: type, values: Mapping[str, Any], prefix: str) -> None:
  names = [field.name for field in dataclasses.fields(kind)]
  faults = [f"unknown {prefix}.{name}" for name in values if name not in names]
  if faults:
    raise ValueError(f"{'; '.join(faults)}; valid: {', '.join(names)}")
