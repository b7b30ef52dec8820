"""From names and flags to a config: defaults, preset, overrides, checks."""

import dataclasses
import difflib
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import ml_collections
import pydantic

from lfgp_dmc.agents import fields
from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.launch.configs.algorithms import ALGORITHMS
from lfgp_dmc.launch.configs.presets import (
  HANDCRAFTED,
  OF_BLOCKS,
  OF_TASK,
  PRESETS,
)
from lfgp_dmc.launch.configs.run_config import RunConfig
from lfgp_dmc.runs.pytree import flattened

KIND = ".kind"  # the end of names of fields that choose a group's class

# Main task -> the task of the run that the paper's transfers start from.
SOURCE_TASKS = {
  "stack": "move_object",
  "bring": "move_object",
  "unstack_stack": "stack",
  "insert": "bring",
}
_PATHS = ("demonstrations", "transfer_from", "init_from")
_Config = TypeVar("_Config", bound=RunConfig | LfgpConfig | BcConfig)


def make_config(
  algorithm: str = "lfgp",
  preset: str = "paper",
  main_task: str = "stack",
  kinds: Mapping[str, str] | None = None,
  environment: str = "",
) -> ml_collections.ConfigDict:
  """All fields of a run with their defaults, locked.

  Args:
    algorithm: decides the fields of `agent`.
    preset: changes defaults, some by the main task.
    main_task: as above.
    kinds: such as {"agent.scheduler.kind": "uniform"}; they decide the fields
      of their groups.
    environment: if there is one, what presets know of our blocks is left out.

  Raises:
    ValueError: an unknown name; the message lists the valid ones.
  """
  for what, name, valid in (
    ("algorithm", algorithm, ALGORITHMS),
    ("preset", preset, PRESETS),
  ):
    if name not in valid:
      raise ValueError(f"unknown {what} {name!r}; valid: {', '.join(valid)}")
  chosen = ALGORITHMS[algorithm]
  of_preset = {**PRESETS[preset], **OF_TASK.get((preset, main_task), {})}
  if environment:  # whose tasks are not ours, even of the same name
    of_preset = _without_blocks(PRESETS[preset], kinds or {})
  applying = {
    name: value
    for name, value in of_preset.items()
    if not {*name.split(".")} & {*chosen.without}
  }
  values = _layered(applying, chosen.defaults, kinds or {})
  groups = {field.name for field in dataclasses.fields(chosen.agent_config)}
  of_kinds = {
    group: {"kind": values[name]}
    for group in groups
    if (name := f"agent.{group}{KIND}") in values
  }
  agent, faults = _checked(chosen.agent_config, of_kinds, "config.agent")
  if agent is None:
    raise ValueError("\n".join(faults))
  run = RunConfig(algorithm=algorithm, agent=agent)
  config = ml_collections.ConfigDict(dataclasses.asdict(run)).lock()
  names = dict(flattened(config.to_dict()))
  config.update_from_flattened_dict(
    {name: value for name, value in values.items() if name in names}
  )
  return config


def from_dict(values: Mapping[str, Any]) -> RunConfig:
  """Checks and freezes nested values, such as those of a `config.json`.

  A field that is not there, since the run is older than it, has its default.
  In paths, {main_task} and {source_task} (of a transfer) are filled in.

  Raises:
    ValueError: an unknown field, or a value out of its range; a line each.
  """
  name = values.get("algorithm")
  if not isinstance(name, str) or name not in ALGORITHMS:
    raise ValueError(
      f"config.algorithm is {name!r}; valid: {', '.join(ALGORITHMS)}"
    )
  given = values.get("agent")
  if not isinstance(given, Mapping):
    raise ValueError(f"config.agent is {given!r}; valid: its fields")
  kinds = {
    f"agent.{group}{KIND}": of_group["kind"]
    for group, of_group in given.items()
    if isinstance(of_group, Mapping) and "kind" in of_group
  }
  defaults = make_config(name, kinds=kinds).to_dict()
  known = dict(flattened(defaults))
  unknown = [name for name, _ in flattened(values) if name not in known]
  if unknown:
    raise ValueError(
      "\n".join(
        f"unknown config.{name}; {hint(name, known)}" for name in unknown
      )
    )
  merged = _merged(defaults, values)
  agent, faults = _checked(
    ALGORITHMS[name].agent_config, merged["agent"], "config.agent"
  )
  merged |= {path: fill(merged[path], merged) for path in _PATHS}
  merged["agent"] = agent
  if agent is None:  # still, all faults of the run are listed
    merged |= {"agent": LfgpConfig(), "init_from": ""}
  run, more = _checked(RunConfig, merged, "config")
  if run is None or faults:
    raise ValueError("\n".join([*more, *faults]))
  return run


def fill(path: Any, config: Mapping[str, Any]) -> Any:
  """The path with its {main_task} and {source_task} filled in."""
  if not isinstance(path, str):
    return path
  task = str(config.get("main_task", ""))
  path = path.replace("{main_task}", task)
  if "{source_task}" in path and task not in SOURCE_TASKS:
    raise ValueError(
      f"config.main_task is {task!r}; valid, with {path}: "
      f"{', '.join(SOURCE_TASKS)}"
    )
  return path.replace("{source_task}", SOURCE_TASKS.get(task, ""))


def hint(name: str, known: Iterable[str], prefix: str = "config.") -> str:
  """What may have been meant by an unknown dotted name."""
  close = difflib.get_close_matches(name, list(known))
  if not close:
    return "see --help"
  return f"did you mean {' or '.join(prefix + other for other in close)}?"


def _without_blocks(
  of_preset: Mapping[str, Any], kinds: Mapping[str, str]
) -> dict[str, Any]:
  """A preset for environments of which it knows nothing."""
  kept = {k: v for k, v in of_preset.items() if k not in OF_BLOCKS}
  kind = "agent.scheduler.kind"
  return {
    k: kinds.get(k, "weighted_random") if (k, v) == (kind, HANDCRAFTED) else v
    for k, v in kept.items()
  }


def _layered(*layers: Mapping[str, Any]) -> dict[str, Any]:
  """Later layers over earlier; another kind drops its group's fields."""
  values: dict[str, Any] = {}
  for layer in layers:
    for name, value in layer.items():
      if name.endswith(KIND) and values.get(name, value) != value:
        group = name.removesuffix("kind")
        values = {k: v for k, v in values.items() if not k.startswith(group)}
    values |= layer
  return values


def _merged(
  values: Mapping[str, Any], changes: Mapping[str, Any]
) -> dict[str, Any]:
  """Nested values with nested changes."""
  merged = dict(values)
  for name, value in changes.items():
    old = merged.get(name)
    if isinstance(old, Mapping) and isinstance(value, Mapping):
      value = _merged(old, value)
    merged[name] = value
  return merged


def _checked(
  kind: type[_Config], values: Mapping[str, Any], prefix: str
) -> tuple[_Config | None, list[str]]:
  """The config, or None and its faults."""
  try:
    return kind(**values), []
  except pydantic.ValidationError as error:
    return None, fields.faults(error, values, prefix)
