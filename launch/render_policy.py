"""Renders a run, a stored policy or the scripted expert; or just the world.

  python launch/render_policy.py --expert=scripted --task=stack
  python launch/render_policy.py --run=runs/stack_1 --task=scheduled \
      --output=runs/scheduled.mp4
  python launch/render_policy.py --run=runs/stack_1 --grid=2x3
  python launch/render_policy.py --what=strips --expert=scripted \
      --output=runs/example_runs.png
  python launch/render_policy.py --what=reset --task=insert

--what=episode plays one, or --grid=2x3 six of them with consecutive seeds side
by side. --what=strips finds a successful episode of each main task (of the
expert, or of each run of --run=a,b,c,d) and shows it as a row of frames.
--what=reset shows the world after a reset. The suffix of --output chooses a
clip (.mp4, .gif, .webp) or a picture (.png; of an episode a film strip); what
it shows goes into a JSON file beside it.
"""

import functools
import pathlib
import re
from collections.abc import Sequence

from absl import flags

import lfgp_dmc
from lfgp_dmc.data import files
from lfgp_dmc.launch import clips, command, policies
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.pictures import film_strips, recorder, video
from lfgp_dmc.task_names import CONTROL_RATES

_RUN = flags.DEFINE_string(
  "run", "", "A run's folder, or a policy folder; several for strips."
)
_EXPERT = flags.DEFINE_enum(
  "expert", None, [policies.SCRIPTED], "Instead of --run."
)
_HERTZ = flags.DEFINE_integer(
  "control_hz", 20, "With --expert: 20, 10 or 5 control steps a second."
)
_WHAT = flags.DEFINE_enum(
  "what", "episode", ["episode", "strips", "reset"], "What is shown."
)
_TASK = flags.DEFINE_string(
  "task", "", "The intention, or scheduled; default: the main task."
)
_COLLECTION = flags.DEFINE_enum(
  "collection", "reset", ["reset", "play"], "play: task after task, no reset."
)
_OUTPUT = flags.DEFINE_string(
  "output", "", ".mp4, .gif, .webp or .png; default: runs/videos/NAME_TASK.mp4."
)
_GRID = flags.DEFINE_string("grid", "1x1", "Rows x columns of seeds.")
_SEED = flags.DEFINE_integer("seed", 0, "Of the (first) reset.", lower_bound=0)
_CAMERA = flags.DEFINE_string("camera", "three_quarter", "The camera's name.")
_HEIGHT = flags.DEFINE_integer("height", 480, "In pixels.", 32, 4320)
_WIDTH = flags.DEFINE_integer("width", 640, "In pixels.", 32, 7680)
_SHADOWS = flags.DEFINE_bool(
  "shadows", True, "Shadows and smooth edges; without, 3 times as fast."
)
_EVERY = flags.DEFINE_integer("every", 1, "50 ms a frame.", lower_bound=1)
_STEPS = flags.DEFINE_integer(
  "steps", 0, "Control steps at most; 0: the whole episode.", lower_bound=0
)
_OVERLAY = flags.DEFINE_bool("overlay", True, "Draw intention and success.")
_STRIP = flags.DEFINE_integer(
  "strip_frames", 6, "Frames of a film strip (.png).", lower_bound=1
)
_ATTEMPTS = flags.DEFINE_integer(
  "attempts", 20, "Episodes in which strips look for success.", lower_bound=1
)
_UNTIL = flags.DEFINE_bool(
  "until_success", False, "Stop a second after the task's success."
)

_USELESS = {
  "episode": (_ATTEMPTS,),
  "strips": (_COLLECTION, _EVERY, _GRID, _OVERLAY, _STEPS, _UNTIL),
  "reset": (_ATTEMPTS, _EVERY, _OVERLAY, _STEPS, _STRIP, _UNTIL),
}

_MOST_CELLS = 100
_RATE = 20.0  # 50 ms a second


def main() -> None:
  """Plays, renders and writes."""
  rows, columns = _grid()
  command.check_choice("control_hz", _HERTZ.value, CONTROL_RATES)
  if _COLLECTION.value == "play" and not _EXPERT.value:
    raise UserError("--collection=play needs --expert=scripted")
  if _HERTZ.present and not _EXPERT.value:
    raise UserError("--control_hz goes with --expert=scripted")
  if _WHAT.value == "strips" and _RUN.value and _TASK.value:
    raise UserError("--task goes with --expert: strips show runs' main tasks")
  if _WHAT.value == "reset" and (_RUN.value or _EXPERT.value):
    raise UserError("--what=reset shows the world alone, without an actor")
  for flag in _USELESS[_WHAT.value]:
    if flag.present:
      raise UserError(f"--{flag.name} does nothing with --what={_WHAT.value}")
  if _TASK.value and (_EXPERT.value or _WHAT.value == "reset"):
    command.check_choice("task", _TASK.value, lfgp_dmc.ALL_TASKS)
  look = recorder.Look(
    max(32, _HEIGHT.value // rows),
    max(32, _WIDTH.value // columns),
    _CAMERA.value,
    _EVERY.value,
    _OVERLAY.value and _WHAT.value == "episode",
    _SHADOWS.value,
  )
  if _WHAT.value == "strips":
    _film_strips(look)
  else:
    seeds = range(_SEED.value, _SEED.value + rows * columns)
    film = _film if _WHAT.value == "episode" else _picture_of_resets
    film(look, seeds, columns)


def _film(look: recorder.Look, seeds: Sequence[int], columns: int) -> None:
  """An episode, or a grid of them."""
  is_play = _COLLECTION.value == "play"
  spec = policies.find(_RUN.value, _EXPERT.value, _TASK.value, _HERTZ.value)
  task = _TASK.value or spec.main_task
  command.check_choice("task", task, (*spec.tasks, clips.SCHEDULED))
  output = _output(f"{spec.name}_{'play' if is_play else task}")
  goal = spec.main_task if task == clips.SCHEDULED else task
  steps, until = _STEPS.value or None, goal if _UNTIL.value else None
  limits = {"max_steps": steps, "until_success_of": until}
  played = [
    clips.play(spec, task, seed, look, is_play, **limits) for seed in seeds
  ]
  shown = [
    {"seed": seed, **clip.summary()}
    for seed, clip in zip(seeds, played, strict=True)
  ]
  metadata = {
    "actor": spec.name,
    "task": task,
    "main_task": spec.main_task,
    "collection": _COLLECTION.value,
    "camera": look.camera,
    "env_step": spec.env_step,
    **shown[0],
    **({"grid": shown} if len(shown) > 1 else {}),
  }
  frames = video.grid([clip.frames for clip in played], columns)
  if output.suffix == ".png":
    frames = video.film_strip(frames, _STRIP.value if len(played) == 1 else 1)
  video.write(output, frames, _RATE / look.every, metadata)
  for clip in played:
    done = ", ".join(f"{k} at step {v}" for k, v in clip.first_success.items())
    print(f"successes: {done or 'none'}")
  print(output)


def _film_strips(look: recorder.Look) -> None:
  """A row of frames for each main task."""
  if _EXPERT.value:
    tasks = [_TASK.value] if _TASK.value else lfgp_dmc.MAIN_TASKS
    expert = functools.partial(policies.find, "", _EXPERT.value)
    specs = [expert(task, _HERTZ.value) for task in tasks]
  else:
    specs = [policies.find(run) for run in _RUN.value.split(",")]
  output = _output("strips", (".png",))
  seeds = range(_SEED.value, _SEED.value + _ATTEMPTS.value)
  cells, shown = [], []
  for spec in specs:
    task = spec.main_task
    play = functools.partial(clips.play, spec, task)
    try:
      row, seed, step = film_strips.row(play, task, seeds, look, _STRIP.value)
    except ValueError as error:
      raise UserError(
        f"{spec.name}: {error}; try more --attempts or another --seed"
      ) from None
    cells += [[frame] for frame in row]
    shown.append({"task": task, "actor": spec.name, "seed": seed,
                  "success_at": step})  # fmt: skip
  video.write(output, video.grid(cells, _STRIP.value), metadata={"rows": shown})
  print(output)


def _picture_of_resets(look: recorder.Look, seeds, columns: int) -> None:
  """The world after resets, before anybody acts."""
  task = _TASK.value or lfgp_dmc.MAIN_TASKS[0]
  output = _output(f"reset_{task}", (".png",))
  expert = policies.find("", policies.SCRIPTED, task)
  resets = [clips.play(expert, task, seed, look, max_steps=0) for seed in seeds]
  frames = video.grid([clip.frames for clip in resets], columns)
  metadata = {"task": task, "seed": seeds[0], "camera": look.camera}
  video.write(output, frames, metadata=metadata)
  print(output)


def _grid() -> tuple[int, int]:
  match = re.fullmatch(r"([1-9]\d?)x([1-9]\d?)", _GRID.value)
  rows, columns = map(int, match.groups()) if match else (0, 0)
  if not 0 < rows * columns <= _MOST_CELLS:
    raise UserError(
      f"--grid={_GRID.value}; valid: ROWSxCOLUMNS, at most {_MOST_CELLS} cells"
    )
  return rows, columns


def _output(
  stem: str, formats: tuple[str, ...] = video.FORMATS
) -> pathlib.Path:
  """The path of the picture: a new file of a known format."""
  default = f"runs/videos/{stem}{formats[0]}".replace(" ", "_")
  output = pathlib.Path(_OUTPUT.value or files.unused(pathlib.Path(default)))
  if output.suffix not in formats:
    raise UserError(
      f"--output={output}: unknown format; valid: {', '.join(formats)}"
    )
  for path in (output, video.sidecar(output)):
    if path.exists():
      raise UserError(f"{path} exists; choose another --output")
    files.check_writable(path)
  return output


cli = functools.partial(command.run, main, render=True)

if __name__ == "__main__":
  cli()
