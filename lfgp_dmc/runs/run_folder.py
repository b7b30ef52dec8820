"""A run's folder: `config.json`, CSVs, `checkpoints/`, `replay/`.

It belongs to one process at a time, by a lock on `run.lock`.
"""

import dataclasses
import datetime
import fcntl
import json
import pathlib
import shutil
from collections.abc import Callable, Mapping
from typing import Any

from lfgp_dmc.data import files
from lfgp_dmc.runs import pytree

CONFIG_NAME = "config.json"
ARRAYS_NAME = "policy.safetensors"
EVALUATION_NAME = "evaluation.csv"
METRICS_NAME = "metrics.csv"
# Added to the config by the run: the options of the policy's arrays, so that
# its folder is a policy folder too.
POLICY_FIELD = "policy"
# When a run is resumed: neither changes a number, if the data are the same.
_MAY_CHANGE = ("demonstrations", "demonstrations_sha256", "evaluation_workers")
_LOCK = "run.lock"
_SHOWN = 4  # differing fields in a message


@dataclasses.dataclass(frozen=True)
class RunFolder:
  """The places in one run's folder."""

  path: pathlib.Path
  _lock: Any = dataclasses.field(repr=False, compare=False, default=None)

  @property
  def evaluation(self) -> pathlib.Path:
    """A row an evaluation episode, CSV."""
    return self.path / EVALUATION_NAME

  @property
  def metrics(self) -> pathlib.Path:
    """A row of means every `log_every` steps, CSV."""
    return self.path / METRICS_NAME

  @property
  def checkpoints(self) -> pathlib.Path:
    """The folder of checkpoints."""
    return self.path / "checkpoints"

  @property
  def replay(self) -> pathlib.Path:
    """The folder of the mapped replay."""
    return self.path / "replay"

  @property
  def has_policy(self) -> bool:
    """Whether a policy was stored in it."""
    return (self.path / ARRAYS_NAME).exists()

  @property
  def is_run(self) -> bool:
    """Whether a run has worked in it; else it is a policy folder."""
    return (self.path / _LOCK).exists()


def default_path(
  algorithm: str,
  task: str,
  parent: files.Path = "runs",
  now: datetime.datetime | None = None,
) -> pathlib.Path:
  """Such as `runs/20220131_235959_012345_lfgp_stack`.

  The microseconds tell runs apart that start together. With `_2`, ... if it
  exists all the same.
  """
  now = datetime.datetime.now() if now is None else now
  stem = f"{now:%Y%m%d_%H%M%S_%f}_{algorithm}_{task}"
  return files.unused(pathlib.Path(parent) / stem)


def create(path: files.Path, config: Mapping[str, Any]) -> RunFolder:
  """Makes a new run's folder, and its parents, writes its config, locks it.

  Raises:
    ValueError: the folder exists.
    OSError: it cannot be made or written.
  """
  path = pathlib.Path(path)
  try:
    path.mkdir(parents=True)
  except FileExistsError:
    raise ValueError(
      f"{path} exists; continue it with --resume, or choose another --run"
    ) from None
  try:
    run = RunFolder(path, _locked(path))
    files.write_json(path / CONFIG_NAME, config)
  except BaseException:
    shutil.rmtree(path)
    raise
  return run


def resume(
  path: files.Path,
  config: Mapping[str, Any],
  complete: Callable[[dict[str, Any]], dict[str, Any]] = dict,
) -> RunFolder:
  """Opens an existing run's folder and locks it.

  Args:
    path: of the run.
    config: of the command; it must equal the run's own, except for more
      steps, another number of workers, and demonstrations elsewhere.
    complete: gives a stored config the fields that are newer than the run.

  Raises:
    ValueError: there is no such run, another process is running it, or its
      config differs (the message names the fields).
    OSError: it may not be written to.
  """
  path = pathlib.Path(path)
  known = complete(settings(read_config(path)))
  run = RunFolder(path, _locked(path))
  fields = _differing_fields(known, settings(config))
  if fields:
    shown = fields[:_SHOWN]
    if more := len(fields) - len(shown):
      shown.append(f"and {more} more")
    raise ValueError(
      f"{path} was started with another config; --resume keeps it. Differing: "
      + "; ".join(shown)
    )
  return run


def settings(config: Mapping[str, Any]) -> dict[str, Any]:
  """A run's config without the fields that the run added."""
  return {k: v for k, v in config.items() if k != POLICY_FIELD}


def read_config(path: files.Path) -> dict[str, Any]:
  """The config that a run or policy folder was written with.

  Raises:
    ValueError: the folder or its config is missing or damaged.
  """
  path = pathlib.Path(path)
  if not path.is_dir():
    raise ValueError(f"no run folder {path}")
  if not (path / CONFIG_NAME).is_file():
    raise ValueError(f"{path} is not a run: it has no {CONFIG_NAME}")
  config = files.read_json(path / CONFIG_NAME)
  if not isinstance(config, dict) or not isinstance(
    config.get(POLICY_FIELD, {}), dict
  ):
    raise ValueError(f"{path / CONFIG_NAME} holds no config")
  return config


def _differing_fields(
  known: Mapping[str, Any], given: Mapping[str, Any]
) -> list[str]:
  """What differs and may not: `agent.xi (45, now 90)`, ..."""
  # As JSON, so that tuples equal lists.
  first, second = (
    {name: json.dumps(value) for name, value in pytree.flattened(config)}
    for config in (known, given)
  )
  names = [*first, *(name for name in second if name not in first)]
  # First what decides which others there are.
  names.sort(key=lambda name: not name.endswith(("algorithm", "kind")))
  return [
    f"{name} ({first.get(name, 'unset')}, now {second.get(name, 'unset')})"
    for name in names
    if first.get(name) != second.get(name)
    and name not in _MAY_CHANGE
    and not (name == "env_steps" and given[name] > known[name])
  ]


def _locked(path: pathlib.Path):
  """An open file whose lock the system releases however the process ends."""
  file = open(path / _LOCK, "w")  # noqa: SIM115 - held open by the run
  try:
    with files.naming(file.name):  # some file systems have no locks
      fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
  except BlockingIOError:
    file.close()
    raise ValueError(
      f"another process is running {path}; wait for it or stop it"
    ) from None
  return file
