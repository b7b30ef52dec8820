"""The play world as a dm_env environment: Composer, made fast and seedable."""

import math
import numbers
from collections.abc import Callable
from typing import Any

import dm_env
import numpy as np
from absl import logging
from dm_control import composer
from dm_control.composer import observation
from dm_control.rl import control

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.initialisers import Request
from lfgp_dmc.tasks.play import PlayTask

_LEAST_NORM = 1e-6  # of a quaternion, which MuJoCo normalises


class _OncePerStepUpdater(observation.Updater):
  """Reads every enabled observable once a control step, without buffers.

  Composer's updater keeps a schedule and a buffer for each observable, at
  every physics step: pure overhead unless an observable has a buffer, delay,
  aggregator or corruptor.
  """

  _is_plain = True

  def reset(self, physics, random_state):
    enabled = {k: v for k, v in self._observables.items() if v.enabled}
    was_plain, self._is_plain = (
      self._is_plain,
      all(map(_is_plain, enabled.values())),
    )
    specified = self._enabled_structure or {}
    is_known = was_plain and enabled.keys() == specified.keys()
    if not self._is_plain or not is_known:
      super().reset(physics, random_state)  # buffers; the spec is made of them
    self._readers = {
      name: value.observation_callable(physics, random_state)
      for name, value in enabled.items()
    }

  def prepare_for_next_control_step(self):
    if not self._is_plain:
      super().prepare_for_next_control_step()

  def update(self):
    if not self._is_plain:
      super().update()

  def get_observation(self):
    if not self._is_plain:
      return super().get_observation()
    return {name: read() for name, read in self._readers.items()}


def _is_plain(value) -> bool:
  return (
    value.update_interval == 1
    and value.buffer_size in (None, 1)
    and not value.delay
    and value.aggregator is None
    and value.corruptor is None
  )


def check_seed(seed: Any) -> None:
  """Raises ValueError if it is no integer of 32 bits."""
  if not isinstance(seed, numbers.Integral) or not 0 <= int(seed) < 1 << 32:
    raise ValueError(f"seed is {seed!r}; valid: 0 to {(1 << 32) - 1}")


class PlayEnvironment(composer.Environment):
  """A `composer.Environment` with seeds and requested starts.

  What `copy` and `pickle` make of it is a new environment of the same task and
  options, before its first reset, with the same random state.

  Attributes:
    physics_failures: episodes that ended in a divergence of the simulation.
    checks: checks of the conditions in a control step, one every 50 ms.
    on_check: called after each, for smooth films at low control rates.
    make: builds another, for copies; set by `tasks.load`.
  """

  def __init__(self, task: PlayTask, seed: int | None, time_limit: float):
    if seed is not None:
      check_seed(seed)
    self._steps = 0
    self._reset_next_step: bool
    self._step_limit: float = math.inf
    if math.isfinite(time_limit):
      self._step_limit = round(time_limit / task.control_timestep)
    self.checks = round(task.control_timestep / ws.CHECK_PERIOD)
    self.on_check: Callable[[], None] | None = None
    self.make: Callable[[], PlayEnvironment] | None = None
    self._steps_per_check = round(ws.CHECK_PERIOD / task.physics_timestep)
    self.physics_failures = 0
    super().__init__(
      task,
      time_limit=time_limit,
      random_state=np.random.RandomState(seed),
      raise_exception_on_physics_error=False,
      strip_singleton_obs_buffer_dim=True,
      max_reset_attempts=20,
      recompile_mjcf_every_episode=False,
    )

  def __reduce__(self):
    return self.make, (), self._random_state.get_state()

  def __setstate__(self, random_state):
    self._random_state.set_state(random_state)

  def add_extra_hook(self, hook_name: str, hook_callable) -> None:
    """Composer's, for hooks of a control step.

    Raises:
      ValueError: a hook of physics steps, which are made many at a time here.
    """
    if hook_name.endswith("_substep"):
      raise ValueError(f"no hook {hook_name!r}; valid: hooks of control steps")
    super().add_extra_hook(hook_name, hook_callable)

  @property
  def needs_reset(self) -> bool:
    """Whether no episode is under way: a step would begin one."""
    return self._reset_next_step

  def _make_observation_updater(self):
    return _OncePerStepUpdater(
      self._task.observables,
      physics_steps_per_control_step=1,
      strip_singleton_buffer_dim=True,
    )

  def reset(self) -> dm_env.TimeStep:
    """Starts an episode from the environment's random state."""
    self._steps = 0
    self._reset_next_step = True  # until it has succeeded
    return super().reset()

  def reset_to(
    self, tcp=None, blue=None, green=None, fingers: float | None = None
  ) -> dm_env.TimeStep:
    """Starts an episode at rest in a requested state; None is sampled.

    What is sampled is as fair as at a plain reset: the robot does not touch it,
    and if neither block is given, no main task is done.

    Args:
      tcp: [3], m, in the robot's base frame; outside the set-point's box
        (`workspace.py`) the control pulls it back in.
      blue: [7], x y z in m and quaternion w x y z.
      green: [7], likewise.
      fingers: opening of both, 0 closed to 1 open; held until the first
        gripper command.

    Raises:
      ValueError: a wrong shape, a value that is not finite, a quaternion of
        zeros, an opening outside [0, 1], a TCP that the arm cannot reach, or
        one in the way of every block that could be sampled.
    """
    opening = _checked("fingers", fingers, ())
    if opening is not None and not 0.0 <= opening <= 1.0:
      raise ValueError(f"fingers={fingers!r}; valid is 0 (closed) to 1 (open)")
    self._task.request = Request(
      tcp=_checked("tcp", tcp, (3,)),
      blue=_checked("blue", blue, (7,)),
      green=_checked("green", green, (7,)),
      fingers=None if opening is None else float(opening),
    )
    return self.reset()

  def reseed(self, seed: int) -> None:
    """Makes the next reset and all that follows depend on `seed` alone.

    Raises:
      ValueError: it is no integer of 32 bits.
    """
    check_seed(seed)
    self._random_state.seed(seed)

  def clear_success(self) -> None:
    """Restarts every hold and latch, as play-based collection needs."""
    self._task.clear_success()

  def step(self, action) -> dm_env.TimeStep:
    """One control step.

    Success never ends an episode. The time limit gives LAST with discount 1;
    a divergence of the simulation gives LAST with discount 0, is logged and
    counted in `physics_failures`.

    Raises:
      ValueError: the action has a wrong shape or is not finite.
    """
    if self._reset_next_step:
      return self.reset()
    physics, task = self._physics_proxy, self._task
    self._hooks.before_step(physics, action, self._random_state)
    self._observation_updater.prepare_for_next_control_step()
    failed = False
    try:
      for _ in range(self.checks):
        self._physics.step(self._steps_per_check)
        task.check(physics)
        if self.on_check is not None:
          self.on_check()
    except control.PhysicsError as error:
      self.physics_failures += 1
      failed = True
      logging.warning("physics failure, the episode ends: %s", error)
    self._steps += 1
    self._hooks.after_step(physics, self._random_state)
    self._observation_updater.update()
    reward = 0.0 if failed else task.get_reward(physics)
    is_last = failed or self._steps >= self._step_limit
    self._reset_next_step = is_last
    return dm_env.TimeStep(
      dm_env.StepType.LAST if is_last else dm_env.StepType.MID,
      reward,
      0.0 if failed else 1.0,
      self._observation_updater.get_observation(),
    )


def _checked(name: str, value, shape: tuple[int, ...]) -> np.ndarray | None:
  if value is None:
    return None
  try:
    value = np.asarray(value, dtype=np.float64)
  except (TypeError, ValueError):
    raise ValueError(f"{name} is {value!r}; valid: numbers") from None
  if value.shape != shape:
    raise ValueError(f"{name} has shape {value.shape}; valid is {shape}")
  if not np.isfinite(value).all():
    raise ValueError(f"{name}={value} holds values that are not finite")
  if shape == (7,) and np.linalg.norm(value[3:]) < _LEAST_NORM:
    raise ValueError(f"{name} has the quaternion {value[3:]}; valid: no zeros")
  return value
