"""From names and flags to a config: defaults, preset, overrides, checks."""

import dataclasses
import difflib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeVar

import ml_collections
import pydantic

from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.launch.configs.algorithms import ALGORITHMS
from lfgp_dmc.launch.configs.presets import OF_TASK, PRESETS
from lfgp_dmc.launch.configs.run_config import RunConfig

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
_SAYS = "Input should be "  # how pydantic starts what is valid


def make_config(
  algorithm: str = "lfgp",
  preset: str = "paper",
  main_task: str = "stack",
  kinds: Mapping[str, str] | None = None,
) -> ml_collections.ConfigDict:
  """All fields of a run with their defaults, locked.

  Args:
    algorithm: a name in `ALGORITHMS`; it decides the fields of `agent`.
    preset: a name in `PRESETS`.
    main_task: some presets differ by it.
    kinds: such as {"agent.scheduler.kind": "uniform"}; they decide the fields
      of their groups.

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
  of_preset = {
    name: value
    for name, value in _of_preset(preset, main_task).items()
    if not {*name.split(".")} & {*chosen.without}
  }
  values = _layered(of_preset, chosen.defaults, kinds or {})
  fields = {field.name for field in dataclasses.fields(chosen.agent_config)}
  chosen_kinds = {
    name.split(".")[1]: {"kind": value}
    for name, value in values.items()
    if name.endswith(KIND)
  }
  groups = {k: v for k, v in chosen_kinds.items() if k in fields}
  agent, faults = _checked(chosen.agent_config, groups, "config.agent")
  if agent is None:
    raise ValueError("\n".join(faults))
  run = RunConfig(algorithm=algorithm, agent=agent)
  config = ml_collections.ConfigDict(dataclasses.asdict(run)).lock()
  known = dict(flattened(config.to_dict()))
  config.update_from_flattened_dict(
    {name: value for name, value in values.items() if name in known}
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
  In paths, {main_task} and {source_task} (of a transfer) are filled in.

  Raises:
    ValueError: an unknown field, or a value out of its range; a line each.
  """
  name = values.get("algorithm")
  if name not in ALGORITHMS:
    raise ValueError(
      f"config.algorithm is {name!r}; valid: {', '.join(ALGORITHMS)}"
    )
  given = values.get("agent")
  if not isinstance(given, Mapping):
    raise ValueError(f"config.agent is {given!r}; valid: its fields")
  kinds = {
    f"agent.{group}{KIND}": fields["kind"]
    for group, fields in given.items()
    if isinstance(fields, Mapping) and "kind" in fields
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
  if agent is not None:
    merged["agent"] = agent
  else:
    del merged["agent"]
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


def flattened(
  values: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, Any]]:
  """Dotted names and values of all leaves."""
  for name, value in values.items():
    if isinstance(value, Mapping):
      yield from flattened(value, f"{prefix}{name}.")
    else:
      yield prefix + name, value


def hint(name: str, known: Iterable[str], prefix: str = "config.") -> str:
  """What may have been meant by an unknown dotted name."""
  close = difflib.get_close_matches(name, list(known))
  if not close:
    return "see --help"
  return f"did you mean {' or '.join(prefix + other for other in close)}?"


def _of_preset(preset: str, main_task: str) -> dict[str, Any]:
  return {**PRESETS[preset], **OF_TASK.get((preset, main_task), {})}


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
    return None, [_fault(fault, values, prefix) for fault in error.errors()]


def _fault(fault: Any, values: Mapping[str, Any], prefix: str) -> str:
  """Such as "config.agent.scheduler.xi is 0; valid: ..."."""
  says = fault["msg"].removeprefix("Value error, ").removeprefix(_SAYS)
  if not fault["loc"]:  # of fields together: they are named already
    return "\n".join(f"{prefix}.{line}" for line in says.split("\n"))
  name, within = prefix, values
  for part in fault["loc"]:
    if part in within:  # else the kind of a group
      name, within = f"{name}.{part}", within[part]
      within = within if isinstance(within, Mapping) else {}
  if fault["type"] == "union_tag_invalid":
    context = fault["ctx"]
    return (
      f"{name}.kind is {context['tag']!r}; valid: {context['expected_tags']}"
    )
  return f"{name} is {fault['input']!r}; valid: {says}"
