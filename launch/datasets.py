"""The demonstrations of a run: read whole, or collected first if it may."""

import pathlib
import subprocess
import sys
from collections.abc import Sequence

from launch.command import UserError
from launch.configs import ALGORITHMS, RunConfig
from lfgp_dmc import demonstrations, published_examples
from lfgp_dmc.demonstrations import Demonstrations

_COLLECT = pathlib.Path(__file__).with_name("collect_demonstrations.py")


def load(
  config: RunConfig, tasks: Sequence[str], widths: tuple[int, int]
) -> dict[str, Demonstrations]:
  """Task -> demonstrations, checked against the environment's widths.

  Returns:
    Those of the dataset's folder, or none if the agent uses none.

  Raises:
    UserError: the dataset cannot be used; one line a faulty file.
  """
  if not config.uses_demonstrations:
    return {}
  if not config.demonstrations:
    raise UserError(
      "config.demonstrations is not set: give the dataset's folder, see "
      "launch/collect_demonstrations.py"
    )
  folder = pathlib.Path(config.demonstrations)
  if not folder.exists():
    collect_if_asked(config)
  try:
    found = _read(folder, tasks, widths)
    _check_rate(config, found)
  except ValueError as error:
    hint = "" if folder.exists() else f"\ncollect it: {_command(config, '...')}"
    raise UserError(f"{error}{hint}") from None
  found = _counted(config, found)
  if config.mirror_demonstrations:
    # The room of the tasks imports MuJoCo, whose backend is chosen before.
    from tasks import mirror

    found = mirror.with_images(found)
  return found


def _counted(
  config: RunConfig, found: dict[str, Demonstrations]
) -> dict[str, Demonstrations]:
  """As many pairs or attempts a task as the config says, the first ones.

  Raises:
    UserError: a task has fewer.
  """
  wanted = config.attempts_per_task
  if wanted:
    short = [
      f"{task} ({data.attempts})"
      for task, data in found.items()
      if data.attempts < wanted
    ]
    if short:
      raise UserError(
        f"config.attempts_per_task is {wanted}; {config.demonstrations} has "
        f"fewer whole attempts of {', '.join(short)}"
      )
    return {task: data.first_attempts(wanted) for task, data in found.items()}
  if not config.pairs_per_task:
    return found
  short = [
    f"{task} ({len(data)})"
    for task, data in found.items()
    if len(data) < config.pairs_per_task
  ]
  if short:
    raise UserError(
      f"config.pairs_per_task is {config.pairs_per_task}; "
      f"{config.demonstrations} has fewer "
      f"pairs of {', '.join(short)}"
    )
  return {
    task: data.head(config.pairs_per_task) for task, data in found.items()
  }


def _read(
  folder: pathlib.Path, tasks: Sequence[str], widths: tuple[int, int]
) -> dict[str, Demonstrations]:
  """Reads our own files, or a folder of published examples of success."""
  if published_examples.is_folder_of_examples(folder):
    return published_examples.read_folder(folder, tasks)
  return demonstrations.read_folder(folder, tasks, *widths)


def _check_rate(config: RunConfig, found: dict[str, Demonstrations]) -> None:
  """Raises ValueError if block tasks were shown at another control rate."""
  wrong = [
    f"{task} ({data.attributes['control_hz']})"
    for task, data in found.items()
    if data.attributes.get("control_hz", config.control_hz) != config.control_hz
  ]
  if wrong and not config.environment:
    raise ValueError(
      f"config.control_hz is {config.control_hz}; {config.demonstrations} "
      f"shows another rate: {', '.join(wrong)}"
    )


def collect_if_asked(config: RunConfig) -> None:
  """Collects the dataset if `config.collect_pairs` says so.

  Raises:
    UserError: it could not be collected.
  """
  if not config.collect_pairs:
    return
  command = _command(config, str(config.collect_pairs))
  print(f"collecting demonstrations: {command}", flush=True)
  arguments = [sys.executable, str(_COLLECT), *command.split()[2:]]
  if subprocess.run(arguments).returncode:
    raise UserError(f"{config.demonstrations} could not be collected")


def pairs(found: dict[str, Demonstrations]) -> str:
  """Such as "7 tasks, 63000 pairs"."""
  total = sum(len(data) for data in found.values())
  return f"{len(found)} tasks, {total} pairs"


def _command(config: RunConfig, pairs_per_task: str) -> str:
  is_multitask = ALGORITHMS[config.algorithm].is_multitask
  rate = f"--control_hz={config.control_hz} "
  if config.control_hz == RunConfig.control_hz:
    rate = ""
  own = "" if is_multitask else f"--tasks={config.main_task} "
  return (
    f"python launch/collect_demonstrations.py --task={config.main_task} {own}"
    f"--pairs_per_task={pairs_per_task} --seed={config.seed} {rate}"
    f"--output={config.demonstrations}"
  )
