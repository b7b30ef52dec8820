"""The simulator side: entities, control, the nine tasks, scripted experts.

Importing this loads no simulator; building an environment does.
"""

import functools
import numbers
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from lfgp_dmc import graphics
from lfgp_dmc.task_names import CONTROL_RATES, check_task

if TYPE_CHECKING:
  from lfgp_dmc.tasks.environment import PlayEnvironment

__all__ = ["load"]

_CHOICES = {
  "reward": ("sparse", "dense"),
  "observations": ("features", "vision", "all"),
  "spawn": ("published", "full_tray"),
  "control_hz": CONTROL_RATES,
  "show_rewards": (False, True),
}


def load(
  task: str,
  seed: int | None = None,
  *,
  reward: str = "sparse",
  observations: str = "features",
  camera_size: int = 64,
  spawn: str = "published",
  control_hz: int = 20,
  time_limit: float = 18.0,
  show_rewards: bool = False,
  **unknown: object,
) -> "PlayEnvironment":
  """Makes the environment of one of the nine tasks, a `composer.Environment`.

  Args:
    task: its name.
    seed: of the environment's random state; None takes one from the system.
    reward: "sparse" (1 while the task's condition holds, else 0) or "dense"
      (the sum of the task's named terms).
    observations: "features" (the eleven components), "vision" (frames of a
      front and a wrist camera, uint8, and the components that a real robot
      senses) or "all".
    camera_size: a frame's height and width in pixels, 32 to 480.
    spawn: "published" (starts in the central 15 x 15 cm) or "full_tray".
    control_hz: 20, 10 or 5 control steps a second.
    time_limit: length of an episode, s; infinity: it ends at no step.
    show_rewards: whether `reward/<task>`, dense, are observed for all tasks.
    **unknown: refused, with the options that there are.

  Raises:
    ValueError: an unknown name or a value out of range, with the valid ones;
      frames where no pictures can be made.
  """
  given = {**locals()}
  del given["seed"], given["unknown"]
  graphics.choose_backend()  # before an import of dm_control
  from lfgp_dmc.tasks.environment import PlayEnvironment
  from lfgp_dmc.tasks.play import PlayTask

  check_task(task)
  if unknown:
    valid = ", ".join(load.__kwdefaults__ or ())
    raise ValueError(f"unknown option {', '.join(unknown)}; valid: {valid}")
  _check(given)
  play = PlayTask(
    task,
    is_dense=reward == "dense",
    shown=observations,
    camera_size=camera_size,
    spawn=spawn,
    control_hz=control_hz,
    show_rewards=show_rewards,
  )
  environment = PlayEnvironment(play, seed, time_limit)
  environment.make = functools.partial(load, **given)
  return environment


def check_choice(name: str, given: Any, valid: Collection[Any]) -> None:
  """Raises ValueError, with the valid ones, if `given` is none of them."""
  if given not in valid:
    names = ", ".join(map(str, valid))
    raise ValueError(f"unknown {name} {given!r}; valid: {names}")


def _check(given: Mapping[str, Any]) -> None:
  """Raises ValueError for the first option that is out of range."""
  for name, valid in _CHOICES.items():
    check_choice(name, given[name], valid)
  size = given["camera_size"]
  if not isinstance(size, numbers.Integral) or not 32 <= int(size) <= 480:
    raise ValueError(f"camera_size is {size!r}; valid: 32 to 480")
  if given["observations"] != "features":
    graphics.allow_pictures()
    if fault := graphics.fault():
      raise ValueError(fault)
  time_limit, control_hz = given["time_limit"], given["control_hz"]
  is_number = isinstance(time_limit, numbers.Real)
  if not is_number or not time_limit * control_hz >= 1:
    raise ValueError(
      f"time_limit={time_limit!r}; valid is {1 / control_hz} s or more"
    )
