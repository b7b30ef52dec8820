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
from collections.abc import Sequence

import dm_env
from absl import flags

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.acting import environments
from lfgp_dmc.data import demonstration_summary, demonstrations, files
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from lfgp_dmc.pictures import film_strips, recorder, video

_DATASET = flags.DEFINE_string("dataset", "", "The dataset's folder.")
_TASK = flags.DEFINE_string(
  "task", "", "The main task, whose T_all is read; default: whatever is there."
)
_ENVIRONMENT = flags.DEFINE_string(
  "environment", "", "As config.environment; default: the block tasks."
)
_CAMERA = flags.DEFINE_integer(
  "camera_size", 0, "As config.camera_size, of demonstrations with frames.", 0
)
_STRIP = flags.DEFINE_string("strip", "", "A .png for the film strips.")

_COLUMNS = 6
_SHOWN = 5  # names in a message
_LOOK = recorder.Look(height=240, width=320)


def main() -> None:
  """Reads every file, prints, and fails if there is a fault."""
  if not _DATASET.value:
    raise UserError("--dataset is not set: give the dataset's folder")
  if _CAMERA.value and _ENVIRONMENT.value:
    raise UserError("--camera_size is of the block tasks, not --environment")
  if _STRIP.value:
    _check_strip(pathlib.Path(_STRIP.value))
  with command.checked_input():
    spec = EnvironmentSpec(
      _TASK.value or lfgp_dmc.MAIN_TASKS[0],
      _ENVIRONMENT.value,
      camera_size=_CAMERA.value,
    )
    with contextlib.closing(spec.build()) as environment:
      asked = spec.tasks(environment) if _TASK.value else ()
      found = _read(environment, asked)
      if _STRIP.value:
        _draw(environment, found)


def _read(
  environment: dm_env.Environment, asked: Sequence[str]
) -> dict[str, demonstrations.Demonstrations]:
  """Reads and describes; raises ValueError with every fault."""
  widths = environments.widths(environment)
  shape = environments.frame_shape(environment)
  folder = pathlib.Path(_DATASET.value)
  paths = files.own(folder, demonstrations.SUFFIX)
  if folder.is_dir() and not (paths or asked):
    there = ", ".join(sorted(path.name for path in folder.iterdir())[:_SHOWN])
    raise ValueError(
      f"no {demonstrations.SUFFIX} file in {folder}; it holds: "
      f"{there or 'nothing'}"
    )
  tasks = asked or [path.stem for path in paths] or ["TASK"]
  found = demonstrations.read_folder(folder, tasks, *widths, shape)
  print(demonstration_summary.table(found))
  rates = sorted({data.attributes["control_hz"] for data in found.values()})
  print(
    f"observations [{widths[0]}], actions [{widths[1]}], control rate: "
    f"{', '.join(f'{rate:g}' for rate in rates)} Hz"
  )
  for task, data in found.items():
    for doubt in demonstration_summary.doubts(data):
      print(f"look again: {task}: {doubt}")
    if not _ENVIRONMENT.value and task not in lfgp_dmc.ALL_TASKS:
      print(
        f"look again: {task} is none of the block tasks; of your own "
        "environment, give --environment"
      )
  if len(rates) > 1:
    raise ValueError(f"{folder} has several control rates")
  return found


def _check_strip(strip: pathlib.Path) -> None:
  if strip.suffix != ".png" or strip.exists():
    raise UserError(f"--strip={strip}; valid: a new .png file")
  if _ENVIRONMENT.value:
    raise UserError("--strip shows the block tasks alone, not --environment")
  if _CAMERA.value:
    raise UserError("--strip draws states; valid: without --camera_size")
  if fault := graphics.fault():
    raise UserError(fault)


def _draw(environment, found) -> None:
  rows = []
  for task, data in found.items():
    frames = film_strips.recorded(environment, data, _LOOK, _COLUMNS)
    rows += [[video.label(frame, task, "")] for frame in frames]
  video.write(_STRIP.value, video.grid(rows, _COLUMNS))
  print(_STRIP.value)


cli = functools.partial(command.run, main, render=True)

if __name__ == "__main__":
  cli()
