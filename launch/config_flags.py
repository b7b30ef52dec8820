"""The flags `--preset` and `--config.x.y=...`, and what they come to.

The fields under `config.agent` depend on the algorithm and on the kinds of its
groups, their defaults on the preset: these are looked up among the arguments
before the flag `config` is defined with them.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import ml_collections
from absl import flags
from ml_collections import config_flags

from lfgp_dmc.launch import configs


def define(
  arguments: Sequence[str], flag_values: flags.FlagValues = flags.FLAGS
) -> None:
  """Defines `--preset`, and `--config.*` for the algorithm, preset and kinds.

  Raises:
    ValueError: an unknown algorithm or preset.
  """
  algorithm = _last(arguments, "config.algorithm", "lfgp")
  preset = _last(arguments, "preset", "paper")
  names = [_name(argument).removeprefix("config.") for argument in arguments]
  kinds = {
    name: _last(arguments, f"config.{name}", "")
    for name in names
    if name.startswith("agent.") and name.endswith(configs.KIND)
  }
  main_task = _last(arguments, "config.main_task", "")
  environment = _last(arguments, "config.environment", "")
  defaults = configs.make_config(
    algorithm, preset, main_task, kinds, environment
  )
  known = dict(configs.flattened(defaults.to_dict()))
  for argument, name in zip(arguments, names, strict=True):
    if _name(argument) == f"config.{name}" and name not in known:
      close = configs.hint(name, known, "--config.")
      raise ValueError(f"unknown --config.{name}; {close}")
  flags.DEFINE_string(
    "preset",
    "paper",
    "Defaults of the config: paper (the paper's tables), ral (the authors' "
    "later journal version), vpace (their latest), fast, fast_precise, few "
    "or pixels (ours). --config.x=... overrides.",
    flag_values=flag_values,
  )
  config_flags.DEFINE_config_dict(
    "config",
    defaults,
    "Settings of the run, as --config.NAME=VALUE; what they mean is said in "
    "launch/configs/run_config.py and agents/*/config.py. Now:\n"
    + "\n".join(f"--config.{name}={value}" for name, value in known.items()),
    flag_values=flag_values,
    sys_argv=[sys.argv[0], *arguments],
  )
  for name in ("config", "preset"):  # so that --help shows them
    flag_values.register_key_flag_for_module(sys.argv[0], flag_values[name])


def resolved(
  flag_values: flags.FlagValues = flags.FLAGS,
) -> configs.RunConfig:
  """The config of the parsed flags; see `configs.from_dict`."""
  return configs.from_dict(flag_values.config.to_dict())


def config_of(*arguments: str) -> configs.RunConfig:
  """What a command with these arguments gets."""
  values = flags.FlagValues()
  expanded = values.read_flags_from_files(list(arguments))
  define(expanded, values)
  values(["command", *expanded])
  return resolved(values)


def resumed(stored: Mapping[str, Any]) -> configs.RunConfig:
  """A run's config with the given settings over it.

  Where they say which fields there are, they are all of it.
  """
  given = config_flags.get_override_values(flags.FLAGS["config"])
  if flags.FLAGS["preset"].present or any(
    name == "algorithm" or name.endswith(configs.KIND) for name in given
  ):
    return resolved()
  config = ml_collections.ConfigDict(configs.from_dict(stored).to_dict())
  config.update_from_flattened_dict(given)
  return configs.from_dict(config.to_dict())


def given() -> list[str]:
  """The names of what is set: the preset, and config fields."""
  values = config_flags.get_override_values(flags.FLAGS["config"])
  preset = ["preset"] if flags.FLAGS["preset"].present else []
  return [*preset, *(f"config.{name}" for name in values)]


def _name(argument: str) -> str:
  return argument.lstrip("-").partition("=")[0] if argument[:1] == "-" else ""


def _last(arguments: Sequence[str], name: str, default: str) -> str:
  """The value of the last `--name=value` or `--name value`."""
  found = default
  for i, argument in enumerate(arguments):
    if _name(argument) != name:
      continue
    _, equals, value = argument.partition("=")
    if equals:
      found = value
    elif i + 1 < len(arguments):
      found = arguments[i + 1]
  return found
