"""Plays one episode and makes frames of it, with a caption on each."""

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import dm_env
import numpy as np

from lfgp_dmc.acting import environments, rollout
from lfgp_dmc.observations import SUCCESS_PREFIX, is_frame
from lfgp_dmc.pictures import video
from lfgp_dmc.types import Actor

# Control step, time step -> the task that acts now.
Switch = Callable[[int, dm_env.TimeStep], str]

_TAIL = 20  # 50 ms checks shown after a success


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
  switches: list[tuple[int, str]]  # control step -> the task that acts from it
  first_success: dict[str, int]  # task -> control step
  steps: int
  checks: int = 1  # 50 ms in a control step

  def summary(self) -> dict[str, Any]:
    """For a sidecar: steps, successes, the step each intention began at."""
    starts = [
      {"from_step": step, "intention": task} for step, task in self.switches
    ]
    return {"steps": self.steps, "first_success": self.first_success,
            "intentions": starts}  # fmt: skip


def record(
  environment: Any,
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
    first: the reset's time step.
    choose: the task that acts.
    seed: of the actor.
    look: of the frames.
    max_steps: control steps at most; None: the whole episode.
    until_success_of: stop one second after this task's success.

  Raises:
    ValueError: see `prepare`.
  """
  prepare(environment, look)
  recorder = _Recorder(environment, actor, first, choose, seed, look)
  clip = recorder.clip
  played = rollout.steps(environment, first, recorder.act)
  try:
    for step in itertools.islice(played, max_steps):
      recorder.timestep = step.timestep
      clip.steps += 1
      for name, value in step.timestep.observation.items():
        if name.startswith(SUCCESS_PREFIX) and np.all(value):
          task = name.removeprefix(SUCCESS_PREFIX)
          clip.first_success.setdefault(task, clip.steps)
      success = clip.first_success.get(until_success_of or "")
      if success and (clip.steps - success + 1) * clip.checks > _TAIL:
        return clip
    recorder.end()
    return clip
  finally:
    environment.on_check = None


def prepare(environment: dm_env.Environment, look: Look) -> None:
  """Sets what must be set before an environment's first picture.

  Raises:
    ValueError: the environment cannot be drawn, or lacks the camera.
  """
  physics = getattr(environment, "physics", None)
  if physics is None:
    raise ValueError(
      "this environment cannot be drawn: it has no attribute `physics`, such "
      "as a dm_control environment's (docs/own_task.md)"
    )
  model = physics.model
  cameras = [model.id2name(i, "camera") for i in range(model.ncam)]
  if look.camera not in cameras:
    raise ValueError(
      f"unknown camera {look.camera!r}; valid: {', '.join(cameras)}"
    )
  if not look.shadows:
    model.light_castshadow[:] = 0
    model.vis.quality.offsamples = 0


class _Recorder:
  """Acts and takes frames, also between control steps at low rates."""

  def __init__(
    self, environment: Any, actor: Actor, first, choose, seed: int, look: Look
  ):
    self.clip = Clip([], [], {}, 0, getattr(environment, "checks", 1))
    self.timestep: dm_env.TimeStep = first
    self._environment, self._look = environment, look
    self._actor, self._choose, self._seed = actor, choose, seed
    self._task, self._check = "", 0
    environment.on_check = self._on_check

  def act(self, observation: np.ndarray) -> np.ndarray:
    """The action of the task that acts now."""
    self.begin_step()
    return self._actor.act(observation)

  def begin_step(self) -> None:
    """Switches the task, and takes the frame that is due."""
    task = self._choose(self.clip.steps, self.timestep)
    if task != self._task:
      self._task = task
      self.clip.switches.append((self.clip.steps, task))
      self._actor.begin(task, self._seed + self.clip.steps)
    self._check = 0
    self._take()

  def end(self) -> None:
    """Takes the frame after the last step, where nobody acts."""
    self._check = 0
    self._take(is_last=self.timestep.last())

  def _on_check(self) -> None:
    self._check += 1
    if self._check < self.clip.checks:  # the next step begins with the last
      self._take()

  def _take(self, is_last: bool = False) -> None:
    clip, look = self.clip, self._look
    now = clip.steps * clip.checks + self._check
    if not look.every or (now % look.every and not is_last):
      return
    frame = self._environment.physics.render(
      look.height, look.width, camera_id=look.camera
    )
    if look.overlay:
      frame = self._captioned(self._with_insets(frame))
    clip.frames.append(frame)

  def _with_insets(self, frame: np.ndarray) -> np.ndarray:
    """What the actor's cameras saw last, along the lower edge."""
    seen = self.timestep.observation
    return video.inset(frame, [seen[name] for name in filter(is_frame, seen)])

  def _captioned(self, frame: np.ndarray) -> np.ndarray:
    main_task = self._look.scheduled_for
    goal, left, right = main_task or self._task, self._task, "success   "
    if main_task:
      left, right = f"scheduler: {left}", f"{main_task} success   "
    has_succeeded = bool(environments.has_succeeded(self.timestep, goal))
    right = f"{right if has_succeeded else ''}step {self.clip.steps}"
    left, right = left.replace("_", " "), right.replace("_", " ")
    return video.label(frame, left, right, highlight=has_succeeded)
