"""The demonstrations of a run: read, or collected first."""

import operator
import pathlib
import shlex
import subprocess
import sys
from collections.abc import Callable, Sequence

from lfgp_dmc import seeding
from lfgp_dmc.data import demonstrations, files
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.launch import sizes
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import ALGORITHMS, RunConfig

_COLLECT = pathlib.Path(__file__).with_name("collect_demonstrations.py")


def load(
  config: RunConfig,
  tasks: Sequence[str],
  widths: tuple[int, int],
  frame_shape: tuple[int, ...] = (),
) -> dict[str, Demonstrations]:
  """Task -> demonstrations; none if the agent uses none.

  Raises:
    UserError: the dataset cannot be used; one line a faulty file.
  """
  if not config.agent.uses_demonstrations:
    return {}
  if not config.demonstrations:
    raise UserError(
      "config.demonstrations is not set: give the dataset's folder, see "
      "launch/collect_demonstrations.py"
    )
  from lfgp_dmc.tasks import mirror, published_examples, translation

  folder = pathlib.Path(config.demonstrations)
  if not folder.exists():
    _collect(config)
  try:
    is_ours = bool(frame_shape or files.own(folder, demonstrations.SUFFIX))
    if not is_ours and published_examples.is_folder_of_examples(folder):
      found = published_examples.read_folder(folder, tasks)
    else:
      found = demonstrations.read_folder(folder, tasks, *widths, frame_shape)
    _check_rate(config, found)
  except ValueError as error:
    hint = "" if folder.exists() else _hint(config)
    raise UserError(f"{error}{hint}") from None
  found = _counted(config, found)
  if config.mirror_demonstrations:
    found = mirror.with_images(found)
  if copies := config.shifted_copies:
    floats = sum(d.action.size + 2 * d.observation.size for d in found.values())
    sizes.refuse("shifted_copies", copies, copies * floats)
    generator = seeding.generator(config.seed, "shifts")
    found = translation.with_copies(found, copies, generator)
  return found


def _counted(
  config: RunConfig, found: dict[str, Demonstrations]
) -> dict[str, Demonstrations]:
  """The first pairs or attempts of each task, if it has as many as wanted."""
  wanted, unit = config.pairs_per_task, "pairs"
  count: Callable[[Demonstrations], int] = len
  cut = Demonstrations.head
  if config.attempts_per_task:
    wanted, unit = config.attempts_per_task, "attempts"
    count, cut = operator.attrgetter("attempts"), Demonstrations.head_attempts
  short = [
    f"{task} ({count(data)})"
    for task, data in found.items()
    if count(data) < wanted
  ]
  if short:
    raise UserError(
      f"config.{unit}_per_task is {wanted}; {config.demonstrations} has fewer "
      f"{unit} of {', '.join(short)}"
    )
  if not wanted:
    return found
  return {task: cut(data, wanted) for task, data in found.items()}


def _check_rate(config: RunConfig, found: dict[str, Demonstrations]) -> None:
  """Raises ValueError if block tasks were demonstrated at another rate."""
  wrong = [
    f"{task} ({data.attributes['control_hz']})"
    for task, data in found.items()
    if data.attributes.get("control_hz", config.control_hz) != config.control_hz
  ]
  if wrong and not config.environment:
    raise ValueError(
      f"config.control_hz is {config.control_hz}; {config.demonstrations} "
      f"has another rate: {', '.join(wrong)}"
    )


def _collect(config: RunConfig) -> None:
  """Collects the dataset if `config.collect_missing` says so."""
  if not config.collect_missing:
    return
  print(f"collecting demonstrations: {_command(config)}", flush=True)
  arguments = [sys.executable, str(_COLLECT), *_flags(config)]
  with subprocess.Popen(arguments) as process:
    try:
      status = process.wait()
    except KeyboardInterrupt:  # `subprocess.run` would kill it
      process.terminate()
      process.wait()
      raise
  # Another run of a sweep may have been faster with the same data.
  if status and not pathlib.Path(config.demonstrations).exists():
    raise UserError(f"{config.demonstrations} could not be collected")


def _hint(config: RunConfig) -> str:
  """How the dataset comes about, as far as the config tells."""
  if config.environment:
    return ""
  if config.attempts_per_task or config.pairs_per_task:
    return f"\ncollect it: {_command(config)}"
  return (
    "\ncollect it by launch/collect_demonstrations.py; the head of a flagfile "
    "says how"
  )


def _command(config: RunConfig) -> str:
  """To be typed into a shell."""
  script = ("python", "launch/collect_demonstrations.py")
  return shlex.join([*script, *_flags(config)])


def _flags(config: RunConfig) -> list[str]:
  unit = "attempts_per_task" if config.attempts_per_task else "pairs_per_task"
  flags = {
    "task": config.main_task,
    "tasks": config.main_task,
    unit: getattr(config, unit),
    "seed": config.seed,
    "control_hz": config.control_hz,
    "camera_size": config.camera_size,
    "output": config.demonstrations,
  }
  if ALGORITHMS[config.algorithm].is_multitask:
    del flags["tasks"]
  for name in ("control_hz", "camera_size"):
    if flags[name] == getattr(RunConfig, name):
      del flags[name]
  return [f"--{name}={value}" for name, value in flags.items()]
