"""The flags `--preset` and `--config.x.y=...`, and what they come to.

The fields under `config.agent` depend on the algorithm and on the kinds of its
groups, their defaults on the preset: these are looked up among the arguments
before the flag `config` is defined with them.
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from absl import flags
from ml_collections import config_flags

from lfgp_dmc.launch import configs
from lfgp_dmc.runs import run_folder


def define(
  arguments: Sequence[str],
  flag_values: flags.FlagValues = flags.FLAGS,
  stored: Mapping[str, Any] | None = None,
) -> None:
  """Defines `--preset`, and `--config.*` for the algorithm, preset and kinds.

  Their defaults are those of the preset, or the values of a `stored` config.

  Raises:
    ValueError: an unknown algorithm or preset.
  """
  values = dict(configs.flattened(stored or {}))
  algorithm = _last(
    arguments, "config.algorithm", values.get("algorithm", "lfgp")
  )
  preset = _last(arguments, "preset", "paper")
  names = [_name(argument).removeprefix("config.") for argument in arguments]
  kinds = {
    name: str(value)
    for name, value in values.items()
    if name.startswith("agent.") and name.endswith(configs.KIND)
  }
  kinds |= {
    name: _last(arguments, f"config.{name}", "")
    for name in names
    if name.startswith("agent.") and name.endswith(configs.KIND)
  }
  main_task = _last(arguments, "config.main_task", "")
  defaults = configs.make_config(algorithm, preset, main_task, kinds)
  known = dict(configs.flattened(defaults.to_dict()))
  known |= {name: value for name, value in values.items() if name in known}
  defaults.update_from_flattened_dict(known)
  for argument, name in zip(arguments, names, strict=True):
    if _name(argument) == f"config.{name}" and name not in known:
      close = configs.hint(name, known, "--config.")
      raise ValueError(f"unknown --config.{name}; {close}")
  flags.DEFINE_string(
    "preset",
    "paper",
    "Defaults of the config: paper (the paper's tables), ral (the authors' "
    "later journal version), fast or fast_precise (ours). --config.x=... "
    "overrides.",
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


def stored(arguments: Sequence[str]) -> dict[str, Any] | None:
  """The config of the run that `--resume` goes on with, if no preset is given.

  Raises:
    ValueError: there is no such run, or its config is damaged.
  """
  names = [_name(argument) for argument in arguments]
  run = _last(arguments, "run", "")
  if "resume" not in names or "preset" in names or not run:
    return None
  task = _last(arguments, "config.main_task", "stack")
  run = configs.fill(run, {"main_task": task})
  found = run_folder.settings(run_folder.read_config(run))
  try:
    return configs.from_dict(found).to_dict()
  except ValueError as error:
    raise ValueError(f"{run}/{run_folder.CONFIG_NAME}: {error}") from None


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
