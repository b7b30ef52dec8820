"""The scripted experts as one actor: a policy a task, noise, gripper values."""

from collections.abc import Callable

import numpy as np

from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks.experts import auxiliary, bringing, stacking
from lfgp_dmc.tasks.experts.motion import Command
from lfgp_dmc.tasks.experts.view import View, look

_NOISE = 0.1  # std of the action noise, in units of the action
_NOISY_FROM = 0.4  # |a| from which the noise is in full
_LEAST_NOISE = 0.25  # share of the noise at rest
_MOST_NOISE = 1.5  # of all factors together
_GRIP = (0.3, 1.0)  # magnitude of gripper commands

POLICIES: dict[str, Callable[[View], Command]] = {
  "stack": stacking.stack,
  "unstack_stack": stacking.stack,
  "bring": bringing.bring,
  "insert": bringing.insert,
  "open_gripper": auxiliary.open_gripper,
  "close_gripper": auxiliary.close_gripper,
  "reach": auxiliary.reach,
  "lift": auxiliary.lift,
  "move_object": auxiliary.move_object,
}


class ScriptedExpert:
  """An `lfgp_dmc.types.Actor` that can do all nine tasks.

  Its mean action is a function of the current observation alone. Noise is
  Gaussian and smaller in slow motion; the gripper's magnitude is drawn anew at
  each step, so that no value of it gives the expert away.
  """

  tasks = ALL_TASKS

  def __init__(self, noise: float = _NOISE, control_hz: int = 20):
    """Takes the noise's std and the environment's control rate.

    Raises:
      ValueError: a negative or non-finite `noise`.
    """
    if not 0.0 <= noise < float("inf"):
      raise ValueError(f"noise={noise!r}; valid is 0 or more")
    self._noise = noise
    self._control_hz = control_hz
    self.begin(ALL_TASKS[0], 0)

  def begin(self, task: str, seed: int) -> None:
    """Starts an attempt at `task`; all randomness follows from `seed`.

    Raises:
      ValueError: an unknown task.
    """
    if task not in POLICIES:
      raise ValueError(
        f"no expert for task {task!r}; valid tasks: {', '.join(POLICIES)}"
      )
    self._policy = POLICIES[task]
    self._random = np.random.default_rng(seed)

  def act(self, observation: np.ndarray) -> np.ndarray:
    """Maps an observation, float32 [59], to an action, float32 [4]."""
    command = self._policy(look(observation, self._control_hz))
    move = np.array(command.move)
    busy = min(float(np.abs(move).max()) / _NOISY_FROM, 1.0)
    share = _LEAST_NOISE + (1.0 - _LEAST_NOISE) * busy
    scale = self._noise * min(command.noise * share, _MOST_NOISE)
    action = np.empty(4, np.float32)
    action[:3] = move + scale * self._random.standard_normal(3)
    action[3] = command.grip * self._random.uniform(*_GRIP)
    return np.clip(action, -1.0, 1.0, out=action)
