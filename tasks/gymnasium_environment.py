"""A block task as a Gymnasium environment, by way of shimmy.

Observations are the flat 59 floats, a box float32 [59]; with
`observations="vision"` a dictionary. What belongs to tasks is in `info`:
  `is_success`: whether the loaded task has succeeded in this episode;
  `successes`, `conditions`: task -> bool for all nine, see `lfgp_dmc`;
  `physics_failure`: whether the simulation broke; such an episode is truncated.

Episodes are truncated at their time limit and never terminate: success does not
end them. After `reset(seed=...)` everything depends on the seed alone.
"""

import inspect
from typing import Any

import gymnasium
import numpy as np

import lfgp_dmc
from lfgp_dmc import graphics, seeding
from lfgp_dmc.acting.environments import TASK_PREFIXES
from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.tasks import check_choice

graphics.choose_backend()  # before shimmy imports dm_control

from shimmy import DmControlCompatibilityV0  # noqa: E402
from shimmy.utils.dm_env import dm_spec2gym_space  # noqa: E402

_FIXED_RENDERING = {"height": 480, "width": 640, "camera_id": "three_quarter"}


class BlockEnvironment(DmControlCompatibilityV0):
  """A Composer environment of this project for Gymnasium."""

  metadata = gymnasium.Env.metadata | {
    "render_modes": ["rgb_array", "depth_array"],
    "render_fps": 20,
  }

  def __init__(
    self,
    task: str,
    render_mode: str | None = None,
    render_kwargs: dict[str, Any] | None = None,
    **options: Any,
  ):
    """Builds the environment of a task; options are those of `lfgp_dmc.load`.

    `render_mode` is None, "rgb_array" or "depth_array"; `render_kwargs` are
    height, width and camera_id of pictures. Raises ValueError if an option is
    wrong, or pictures are wanted where none can be made.
    """
    modes = (None, *self.metadata["render_modes"])
    check_choice("render_mode", render_mode, modes)
    for name in render_kwargs or ():
      check_choice("render_kwargs", name, _FIXED_RENDERING)
    if render_mode and (fault := graphics.fault()):
      raise ValueError(fault)
    self.task_name, self._is_closed = task, False
    self.metadata = dict(self.metadata)  # shimmy writes into it
    env = lfgp_dmc.load(task, **options)
    rendering = {**_FIXED_RENDERING, **(render_kwargs or {})}
    _check_picture(env.physics.model, **rendering)
    super().__init__(env, render_mode, rendering)
    # Of these copies are made anew, not of shimmy's arguments.
    gymnasium.utils.EzPickle.__init__(
      self, task, render_mode, render_kwargs, **options
    )
    self.metadata["render_fps"] = options.get("control_hz", 20)
    self._is_flat = options.get("observations", "features") == "features"
    self.observation_space = self._space()

  def reset(
    self, *, seed: int | None = None, options: dict[str, Any] | None = None
  ) -> tuple[Any, dict[str, Any]]:
    """Starts an episode; `options` are the arguments of `reset_to`.

    Raises ValueError if one of them is wrong.
    """
    for name in options or ():
      valid = inspect.signature(self._env.reset_to).parameters
      check_choice("options", name, valid)
    gymnasium.Env.reset(self, seed=seed)
    if seed is not None:
      # Gymnasium's may be of any size; ours are of 32 bits.
      self._env.reseed(seed if seed < 1 << 32 else seeding.derive(seed))
    start = self._env.reset_to if options else self._env.reset
    timestep = start(**(options or {}))
    return self._observed(timestep.observation), self._info(timestep)

  def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict]:
    """One control step of 50 ms (at 20 Hz); needs a reset after the last."""
    if self._env.needs_reset:
      raise gymnasium.error.ResetNeeded("no episode is under way: call reset()")
    timestep = self._env.step(action)
    observation = self._observed(timestep.observation)
    is_over = bool(timestep.last())
    info = self._info(timestep)
    return observation, float(timestep.reward), False, is_over, info

  def close(self) -> None:
    """Frees the simulator."""
    if not self._is_closed:
      self._env.close()
    self._is_closed = True

  def _space(self) -> gymnasium.Space:
    if self._is_flat:
      size = (OBSERVATION_SIZE,)
      return gymnasium.spaces.Box(-np.inf, np.inf, size, np.float32)
    everything = dm_spec2gym_space(self._env.observation_spec())
    return gymnasium.spaces.Dict(_without_tasks(everything))

  def _observed(self, observation) -> Any:
    if self._is_flat:
      return lfgp_dmc.flatten(observation)
    return {k: np.asarray(v) for k, v in _without_tasks(observation).items()}

  def _info(self, timestep) -> dict[str, Any]:
    successes = lfgp_dmc.successes(timestep.observation)
    return {
      "is_success": successes[self.task_name],
      "successes": successes,
      "conditions": lfgp_dmc.conditions(timestep.observation),
      "physics_failure": bool(timestep.last() and timestep.discount == 0),
    }


def _check_picture(
  model, height: int, width: int, camera_id: int | str
) -> None:
  """Raises ValueError if the model has no such camera, or no room for it."""
  cameras = [model.id2name(i, "camera") for i in range(model.ncam)]
  check_choice("camera_id", camera_id, [*cameras, *range(-1, model.ncam)])
  room = model.vis.global_
  for name, size, most in (
    ("height", height, room.offheight),
    ("width", width, room.offwidth),
  ):
    if not 0 < size <= most:
      raise ValueError(f"render_kwargs: {name} is {size}; valid: 1 to {most}")


def _without_tasks(named) -> dict[str, Any]:
  return {k: v for k, v in named.items() if not k.startswith(TASK_PREFIXES)}
