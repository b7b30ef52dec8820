"""Renders a run, a stored policy or the scripted expert; or just the world.

  python launch/render_policy.py --expert=scripted --task=stack
  python launch/render_policy.py --run=runs/stack_1 --task=scheduled \
      --output=videos/scheduled.mp4
  python launch/render_policy.py --run=runs/stack_1 --grid=2x3
  python launch/render_policy.py --what=strips --expert=scripted \
      --output=videos/example_runs.png
  python launch/render_policy.py --what=reset --task=insert

--what=episode plays one, or --grid=2x3 six of them with consecutive seeds side
by side. --what=strips finds a successful episode of each main task (of the
expert, or of each run of --run=a,b,c,d) and shows it as a row of frames.
--what=reset shows the world after a reset. The suffix of --output chooses a
clip (.mp4, .gif) or a picture (.png; of an episode a film strip); what it shows
goes into a JSON file beside it.
"""

import pathlib
import re
from typing import Any

import numpy as np
from absl import flags

import lfgp_dmc
from lfgp_dmc import graphics, seeding
from lfgp_dmc.launch import command, film_strips, policies, task_switch
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.environment_spec import World
from lfgp_dmc.pictures import recorder, video
from lfgp_dmc.task_names import CONTROL_RATES

_RUN = flags.DEFINE_string(
  "run", "", "A run's folder, or a policy folder; several for strips."
)
_EXPERT = flags.DEFINE_string("expert", "", "scripted: the scripted expert.")
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
  "collection",
  "reset",
  ["reset", "play"],
  "play: the expert goes from task to task without a reset.",
)
_OUTPUT = flags.DEFINE_string(
  "output", "", ".mp4, .gif or .png; default: videos/NAME_TASK.mp4."
)
_GRID = flags.DEFINE_string("grid", "1x1", "Rows x columns of seeds.")
_SEED = flags.DEFINE_integer(
  "seed", 0, "Of the (first) reset and the actor.", lower_bound=0
)
_CAMERA = flags.DEFINE_string("camera", "three_quarter", "The camera's name.")
_HEIGHT = flags.DEFINE_integer(
  "height", 480, "Pixels, of the whole grid.", lower_bound=32
)
_WIDTH = flags.DEFINE_integer(
  "width", 640, "Pixels, of the whole grid.", lower_bound=32
)
_SHADOWS = flags.DEFINE_bool(
  "shadows", True, "Shadows and smooth edges; without, 3 times as fast."
)
_EVERY = flags.DEFINE_integer(
  "every", 1, "50 ms a frame: control steps at 20 Hz.", lower_bound=1
)
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

_MOST_CELLS = 100

_RATE = 20.0  # 50 ms a second


def main() -> None:
  """Plays, renders and writes."""
  rows, columns = _grid()
  command.check_choice("control_hz", _HERTZ.value, CONTROL_RATES)
  task = _TASK.value
  if task and (_EXPERT.value or _WHAT.value == "reset"):
    command.check_choice("task", task, lfgp_dmc.ALL_TASKS)
  if _EXPERT.value:
    command.check_choice("expert", _EXPERT.value, (policies.SCRIPTED,))
  elif _COLLECTION.value == "play":
    raise UserError("--collection=play needs --expert=scripted")
  if _WHAT.value == "strips":
    _film_strips()
  elif _WHAT.value == "reset":
    _picture_of_reset(task or lfgp_dmc.MAIN_TASKS[0], rows, columns)
  else:
    _film(task, rows, columns)


def _film(task: str, rows: int, columns: int) -> None:
  """An episode, or a grid of them."""
  is_play = _COLLECTION.value == "play"
  cast = policies.find(_RUN.value, _EXPERT.value, task, _HERTZ.value)
  task = task or cast.main_task
  if task != task_switch.SCHEDULED:
    command.check_choice("task", task, (*cast.tasks, task_switch.SCHEDULED))
  output = _checked_output(f"{cast.name}_{'play' if is_play else task}")
  world = _checked_world(cast.world)
  played = [
    film_strips.play(
      cast,
      task,
      seed,
      _look(rows, columns),
      is_play=is_play,
      max_steps=_STEPS.value or None,
      until_success=_UNTIL.value,
      environment=world,
    )
    for seed in range(_SEED.value, _SEED.value + rows * columns)
  ]
  metadata = {
    "actor": cast.name,
    "task": task,
    "main_task": cast.main_task,
    "collection": _COLLECTION.value,
    "camera": _CAMERA.value,
    "env_step": cast.env_step,
    **_description(played[0], _SEED.value),
  }
  if len(played) > 1:
    metadata["grid"] = [
      _description(clip, _SEED.value + i) for i, clip in enumerate(played)
    ]
  frames = video.grid([clip.frames for clip in played], columns)
  if output.suffix == ".png":
    frames = video.film_strip(frames, _STRIP.value if len(played) == 1 else 1)
  video.write(output, frames, _RATE / _EVERY.value, metadata)
  for clip in played:
    done = ", ".join(f"{k} at step {v}" for k, v in clip.first_success.items())
    print(f"successes: {done or 'none'}")
  print(output)


def _film_strips() -> None:
  """A row of frames for each main task."""
  if _EXPERT.value:
    casts = [policies.find("", _EXPERT.value, t) for t in lfgp_dmc.MAIN_TASKS]
    if _TASK.value:
      casts = [policies.find("", _EXPERT.value, _TASK.value)]
  else:
    casts = [policies.find(run, "") for run in _RUN.value.split(",")]
  output = _checked_output("strips", (".png",))
  for cast in casts:
    _checked_world(cast.world).close()
  look = recorder.Look(
    _HEIGHT.value,
    _WIDTH.value,
    _CAMERA.value,
    overlay=False,
    shadows=_SHADOWS.value,
  )
  picture, shown = film_strips.rows(
    casts, _SEED.value, look, _STRIP.value, _ATTEMPTS.value
  )
  video.write(output, [picture], metadata={"rows": shown})
  print(output)


def _picture_of_reset(task: str, rows: int, columns: int) -> None:
  """The world after resets, before anybody acts."""
  output = _checked_output(f"reset_{task}", (".png",))
  environment = _checked_world(World(task))
  look = _look(rows, columns)
  recorder.prepare(environment, look)
  pictures = []
  for seed in range(_SEED.value, _SEED.value + rows * columns):
    environment.reseed(seeding.derive(seed, "clip"))
    environment.reset()
    pictures.append([recorder.picture(environment, look)])
  metadata = {"task": task, "seed": _SEED.value, "camera": _CAMERA.value}
  video.write(output, video.grid(pictures, columns), metadata=metadata)
  print(output)


def _description(clip: recorder.Clip, seed: int) -> dict[str, Any]:
  return {
    "seed": seed,
    "steps": clip.steps,
    "first_success": clip.first_success,
    "intentions": task_switch.spans(clip.labels, _EVERY.value / clip.checks),
  }


def _look(rows: int, columns: int) -> recorder.Look:
  return recorder.Look(
    max(32, _HEIGHT.value // rows),
    max(32, _WIDTH.value // columns),
    _CAMERA.value,
    _EVERY.value,
    _OVERLAY.value,
    _SHADOWS.value,
  )


def _grid() -> tuple[int, int]:
  match = re.fullmatch(r"([1-9]\d?)x([1-9]\d?)", _GRID.value)
  if not match or np.prod([int(n) for n in match.groups()]) > _MOST_CELLS:
    raise UserError(
      f"--grid={_GRID.value}; valid: ROWSxCOLUMNS, at most {_MOST_CELLS} cells"
    )
  return int(match[1]), int(match[2])


def _checked_world(world: World):
  """The environment, if it can be drawn by the camera asked for."""
  fault = graphics.fault()
  if fault:
    raise UserError(fault)
  environment = world.build()
  command.check_choice(
    "camera", _CAMERA.value, task_switch.cameras(environment)
  )
  return environment


def _checked_output(
  stem: str, formats: tuple[str, ...] = video.FORMATS
) -> pathlib.Path:
  """Where the picture goes.

  Raises:
    UserError: an unknown suffix, or the file exists.
  """
  default = f"videos/{stem}{formats[0]}".replace(" ", "_")
  output = pathlib.Path(_OUTPUT.value or default)
  if output.suffix not in formats:
    raise UserError(
      f"--output={output}: unknown format; valid: {', '.join(formats)}"
    )
  if output.exists():
    raise UserError(f"{output} exists; choose another --output")
  return output


if __name__ == "__main__":
  command.run(main, render=True)
