"""Renders an episode of a run, a stored policy or the scripted expert.

  python launch/render_policy.py --expert=scripted --task=stack
  python launch/render_policy.py --run=runs/stack_1 --task=scheduled \
      --output=videos/scheduled.mp4

The suffix of --output chooses a clip (.mp4, .gif) or a film strip (.png); what
it shows goes into a JSON file beside it.
"""

import pathlib

from absl import flags

import lfgp_dmc
from launch import actors, clips, command, playing, worlds
from launch.command import UserError
from lfgp_dmc import graphics, seeding, video

_RUN = flags.DEFINE_string("run", "", "A run's folder, or a policy folder.")
_EXPERT = flags.DEFINE_string("expert", "", "scripted: the scripted expert.")
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
_SEED = flags.DEFINE_integer("seed", 0, "Of the reset and the actor.")
_CAMERA = flags.DEFINE_string("camera", "three_quarter", "The camera's name.")
_HEIGHT = flags.DEFINE_integer("height", 480, "Pixels.", lower_bound=32)
_WIDTH = flags.DEFINE_integer("width", 640, "Pixels.", lower_bound=32)
_EVERY = flags.DEFINE_integer(
  "every", 1, "Control steps a frame.", lower_bound=1
)
_STEPS = flags.DEFINE_integer(
  "steps", 0, "Control steps at most; 0: the whole episode.", lower_bound=0
)
_OVERLAY = flags.DEFINE_bool("overlay", True, "Draw intention and success.")
_STRIP = flags.DEFINE_integer(
  "strip_frames", 6, "Frames of a film strip (.png).", lower_bound=1
)
_UNTIL = flags.DEFINE_bool(
  "until_success", False, "Stop a second after the task's success."
)

_RATE = 20.0  # control steps a second


def main() -> None:
  """Plays, renders and writes."""
  is_play = _COLLECTION.value == "play"
  task = _TASK.value
  if _EXPERT.value:
    command.check_choice("expert", _EXPERT.value, (actors.SCRIPTED,))
    if task:
      command.check_choice("task", task, lfgp_dmc.ALL_TASKS)
  elif is_play:
    raise UserError("--collection=play needs --expert=scripted")
  cast = actors.find(_RUN.value, _EXPERT.value, task)
  task = task or cast.main_task
  if task != playing.SCHEDULED:
    command.check_choice("task", task, (*cast.tasks, playing.SCHEDULED))
  output = _checked_output(cast.name, "play" if is_play else task)
  fault = graphics.fault()
  if fault:
    raise UserError(fault)
  clip = _play(cast, task, is_play)
  metadata = {
    "actor": cast.name,
    "task": task,
    "main_task": cast.main_task,
    "collection": "play" if is_play else "reset",
    "seed": _SEED.value,
    "camera": _CAMERA.value,
    "steps": clip.steps,
    "env_step": cast.env_step,
    "first_success": clip.first_success,
    "intentions": playing.spans(clip.labels, _EVERY.value),
  }
  frames = clip.frames
  if output.suffix == ".png":
    frames = video.film_strip(frames, _STRIP.value)
  video.write(output, frames, _RATE / _EVERY.value, metadata)
  done = ", ".join(f"{k} at step {v}" for k, v in clip.first_success.items())
  print(f"successes: {done or 'none'}\n{output}")


def _play(cast: actors.Cast, task: str, is_play: bool) -> clips.Clip:
  """One episode of the intention, of play, or of the whole agent."""
  seed = _SEED.value
  environment = worlds.build(
    cast.environment, cast.main_task, seed=seeding.derive(seed, "clip")
  )
  cameras = playing.cameras(environment)
  command.check_choice("camera", _CAMERA.value, cameras)
  choose = playing.make_switch(cast, task, is_play, environment, seed)
  look = clips.Look(
    _HEIGHT.value, _WIDTH.value, _CAMERA.value, _EVERY.value, _OVERLAY.value
  )
  return clips.record(
    environment,
    cast.make(),
    environment.reset(),
    choose,
    seed,
    look,
    _STEPS.value or None,
    task if _UNTIL.value else None,
  )


def _checked_output(name: str, task: str) -> pathlib.Path:
  """Where the clip goes.

  Raises:
    UserError: an unknown suffix, or the file exists.
  """
  stem = f"{name}_{task}".replace(" ", "_")
  output = pathlib.Path(_OUTPUT.value or f"videos/{stem}.mp4")
  if output.suffix not in video.FORMATS:
    raise UserError(
      f"--output={output}: unknown format; valid: {', '.join(video.FORMATS)}"
    )
  if output.exists():
    raise UserError(f"{output} exists; choose another --output")
  return output


if __name__ == "__main__":
  command.run(main, render=True)
