"""Prints what training would see in a dataset, and every fault of it.

  python launch/check_demonstrations.py --dataset=data/mine
  python launch/check_demonstrations.py --dataset=data/mine --task=stack \
      --strip=data/mine.png

--task also asks for the files of the tasks that it is learned with. --strip
shows an attempt of each task in the block world, a row of frames each.
"""

import contextlib
import functools
import pathlib

import numpy as np
from absl import flags

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.acting import environments
from lfgp_dmc.data import demonstration_report, demonstrations
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from lfgp_dmc.pictures import film_strips, recorder, video

_DATASET = flags.DEFINE_string("dataset", "", "The dataset's folder.")
_TASK = flags.DEFINE_string(
  "task", "", "The main task, of the block tasks; default: any."
)
_ENVIRONMENT = flags.DEFINE_string(
  "environment", "", "As config.environment; default: the block tasks."
)
_STRIP = flags.DEFINE_string("strip", "", "A .png for the film strips.")

_COLUMNS = 6
_LOOK = recorder.Look(height=240, width=320)


def main() -> None:
  """Reads every file, prints, and fails if there is a fault."""
  folder, strip = pathlib.Path(_DATASET.value), pathlib.Path(_STRIP.value)
  if not _DATASET.value:
    raise UserError("--dataset is not set: give the dataset's folder")
  if _STRIP.value:
    _check_strip(strip)
  tasks, widths = _expected(folder)
  print(f"observations [{widths[0]}], actions [{widths[1]}]")
  found, faults = {}, []
  for task in tasks:
    path = folder / (task + demonstrations.SUFFIX)
    try:
      data = demonstrations.read(path, task, *widths)
    except demonstrations.DatasetError as error:
      faults.append(str(error))
      continue
    found[task] = data
    print(demonstration_report.describe(task, data))
    for doubt in demonstration_report.doubts(data):
      print(f"  look again: {doubt}")
  rates = sorted({data.attributes["control_hz"] for data in found.values()})
  if len(rates) > 1:
    faults.append(f"several control rates: {', '.join(map(str, rates))} Hz")
  if faults:
    raise UserError("\n".join([f"{folder} cannot be used:", *faults]))
  if _STRIP.value:
    _draw(strip, found)


def _expected(folder: pathlib.Path) -> tuple[tuple[str, ...], tuple[int, int]]:
  """The tasks whose files are needed, and the widths (O, A).

  Raises:
    UserError: there is no such folder, task or environment.
  """
  if not folder.is_dir():
    raise UserError(f"no dataset folder {folder}")
  task = _TASK.value or lfgp_dmc.MAIN_TASKS[0]
  with command.checked_input():
    environment = EnvironmentSpec(task, _ENVIRONMENT.value).build()
  with contextlib.closing(environment):
    widths = environments.widths(environment)
  if _TASK.value and not _ENVIRONMENT.value:
    return lfgp_dmc.task_set(task), widths
  tasks = tuple(
    path.stem
    for path in sorted(folder.glob(f"*{demonstrations.SUFFIX}"))
    if not path.name.startswith(".")
  )
  if not tasks:
    raise UserError(f"no TASK{demonstrations.SUFFIX} in {folder}")
  return tasks, widths


def _check_strip(strip: pathlib.Path) -> None:
  if strip.suffix != ".png" or strip.exists():
    raise UserError(f"--strip={strip}; valid: a new .png file")
  if _ENVIRONMENT.value:
    raise UserError("--strip shows the block tasks alone, not --environment")
  if fault := graphics.fault():
    raise UserError(fault)


def _draw(strip: pathlib.Path, found: dict[str, Demonstrations]) -> None:
  rows: list[list[np.ndarray]] = []
  with contextlib.closing(lfgp_dmc.load(next(iter(found)))) as environment:
    for task, data in found.items():
      states = film_strips.states(data, _COLUMNS)
      try:
        frames = film_strips.of_states(environment, states, _LOOK)
      except ValueError as error:
        raise UserError(f"{task}: a state cannot be shown: {error}") from None
      rows += [[video.label(frame, task, "")] for frame in frames]
  video.write(strip, video.grid(rows, _COLUMNS), metadata={"tasks": [*found]})
  print(strip)


cli = functools.partial(command.run, main, render=True)

if __name__ == "__main__":
  cli()
