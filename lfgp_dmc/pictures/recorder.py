"""Plays one episode and makes frames of it, with what is going on on top."""

import dataclasses
import itertools
from collections.abc import Callable

import dm_env
import numpy as np

from lfgp_dmc.acting import environments, rollout
from lfgp_dmc.pictures import video
from lfgp_dmc.types import Actor

Switch = Callable[[int, dm_env.TimeStep], str]


@dataclasses.dataclass(frozen=True)
class Look:
  """How frames are made."""

  height: int = 480
  width: int = 640
  camera: str = "three_quarter"
  every: int = 1  # 50 ms a frame: control steps at 20 Hz; 0: no frames
  overlay: bool = True
  shadows: bool = True  # and smooth edges; three quarters of a frame's time
  scheduled_for: str = ""  # the main task, if its scheduler chooses


@dataclasses.dataclass
class Clip:
  """Frames, and what they show."""

  frames: list[np.ndarray]
  labels: list[str]  # the intention of each frame
  first_success: dict[str, int]  # task -> control step
  steps: int
  checks: int = 1  # 50 ms in a control step


def record(
  environment: dm_env.Environment,
  actor: Actor,
  first: dm_env.TimeStep,
  choose: Switch,
  seed: int,
  look: Look,
  max_steps: int | None = None,
  until_success_of: str | None = None,
) -> Clip:
  """Plays from `first` to the episode's end and renders it.

  Args:
    environment: a Composer environment, just reset.
    actor: begins a task whenever `choose` names another.
    first: the reset's timestep.
    choose: control step, timestep -> the task that acts now.
    seed: of the actor.
    look: how frames are made.
    max_steps: control steps at most; None: the whole episode.
    until_success_of: stop one second after this task's success.

  Returns:
    The clip.
  """
  prepare(environment, look)
  recorder = _Recorder(environment, actor, first, choose, seed, look)
  clip, tail = recorder.clip, 0
  played = rollout.steps(environment, first, recorder.act)
  try:
    for step in itertools.islice(played, max_steps):
      recorder.timestep = step.timestep
      clip.steps += 1
      for name in set(_successes(step.timestep)) - set(clip.first_success):
        clip.first_success[name] = clip.steps
      if until_success_of in clip.first_success:
        tail += clip.checks
        if tail > _TAIL:
          return clip
    recorder.begin_step()
    return clip
  finally:
    recorder.close()


class _Recorder:
  """Takes the frames, between control steps too where there is more to see."""

  def __init__(self, environment, actor, first, choose, seed: int, look: Look):
    checks = getattr(environment, "checks", 1)
    self.clip = Clip([], [], {}, 0, checks)
    self.timestep: dm_env.TimeStep = first
    self._task = ""
    self._environment, self._look = environment, look
    self._actor, self._choose, self._seed = actor, choose, seed
    if checks > 1:
      environment.on_check = self._on_check

  def act(self, observation: np.ndarray) -> np.ndarray:
    """The action of the task whose turn it is."""
    self.begin_step()
    return self._actor.act(observation)

  def begin_step(self) -> None:
    """Begins the task whose turn it is; takes the frame if it is due."""
    clip = self.clip
    wanted = self._choose(clip.steps, self.timestep)
    if wanted != self._task:
      self._task = wanted
      self._actor.begin(wanted, self._seed + clip.steps)
    self._check = 0
    self._take(is_last=self.timestep.last())

  def close(self) -> None:
    """Lets go of the environment."""
    if self.clip.checks > 1:
      self._environment.on_check = None  # type: ignore[attr-defined]

  def _on_check(self) -> None:
    self._check += 1
    if self._check < self.clip.checks:  # the next step begins with the last
      self._take()

  def _take(self, is_last: bool = False) -> None:
    clip, look = self.clip, self._look
    now = clip.steps * clip.checks + self._check
    if look.every and (now % look.every == 0 or is_last):
      clip.frames.append(
        _frame(self._environment, self.timestep, self._task, clip, look)
      )
      clip.labels.append(self._task)


_TAIL = 20  # 50 ms checks shown after a success


def prepare(environment: dm_env.Environment, look: Look) -> None:
  """Sets what must be set before an environment's first picture.

  Raises:
    ValueError: the environment cannot be drawn, or lacks the camera.
  """
  physics = getattr(environment, "physics", None)
  if physics is None:
    raise ValueError("this environment has no physics to render")
  model = physics.model
  cameras = [model.id2name(i, "camera") for i in range(model.ncam)]
  if look.camera not in cameras:
    raise ValueError(
      f"unknown camera {look.camera!r}; valid: {', '.join(cameras)}"
    )
  if not look.shadows:
    model.light_castshadow[:] = 0
    model.vis.quality.offsamples = 0


def _successes(timestep: dm_env.TimeStep) -> list[str]:
  prefix = "success/"
  return [
    name.removeprefix(prefix)
    for name, value in timestep.observation.items()
    if name.startswith(prefix) and bool(value)
  ]


def _frame(environment, timestep, task: str, clip: Clip, look: Look):
  frame = environment.physics.render(
    look.height, look.width, camera_id=look.camera
  )
  if not look.overlay:
    return frame
  goal = look.scheduled_for or task
  has_succeeded = bool(environments.has_succeeded(timestep, goal))
  left, success = _words(task), "success   " if has_succeeded else ""
  if look.scheduled_for:
    left = f"scheduler: {left}"
    success = f"{_words(goal)} {success}" if has_succeeded else ""
  return video.label(
    frame, left, f"{success}step {clip.steps}", highlight=has_succeeded
  )


def _words(task: str) -> str:
  return task.replace("_", " ")
