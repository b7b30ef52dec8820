"""LfGP-DMC: Learning from Guided Play in dm_control, from one import.

    import lfgp_dmc
    policy = lfgp_dmc.load_policy("runs/NAME")
    environment = lfgp_dmc.load("stack", 0, **policy.load_options)
    timestep = environment.reset()
    action = policy(lfgp_dmc.flatten(timestep.observation))

Names of tasks: `MAIN_TASKS` (4), `AUXILIARY_TASKS` (5), `ALL_TASKS` (both).
`OBSERVATION_SIZE` is 59 floats; `OBSERVATION_SLICES` says where each component
is in them, its unit (m, m/s, rad/s, ...; quaternions are w x y z), and whether
it needs the simulator's state.

This facade reaches `tasks` and `agents` inside its functions only: importing it
loads neither a simulator nor torch.
"""

import os
from collections.abc import Mapping
from typing import Any

import dm_env
import numpy as np

from lfgp_dmc.observations import (
  OBSERVATION_SIZE,
  OBSERVATION_SLICES,
  conditions,
  flatten,
  successes,
)
from lfgp_dmc.task_names import ALL_TASKS, AUXILIARY_TASKS, MAIN_TASKS, task_set

__all__ = [
  "ALL_TASKS",
  "AUXILIARY_TASKS",
  "MAIN_TASKS",
  "OBSERVATION_SIZE",
  "OBSERVATION_SLICES",
  "StoredPolicy",
  "conditions",
  "flatten",
  "load",
  "load_policy",
  "successes",
  "task_set",
]


def load(
  task: str, seed: int | None = None, **options: Any
) -> dm_env.Environment:
  """Builds the environment of a task.

  Args:
    task: a name in `ALL_TASKS`.
    seed: fixes everything random in the environment; None draws a fresh seed.
    **options: `reward` ("sparse" or "dense"), `observations` ("features",
      "vision" or "all"), `camera_size` (64), `spawn` ("published" or
      "full_tray"), `control_hz` (20 Hz), `time_limit` (18.0 s), `show_rewards`
      (False); see `tasks.load`.

  Returns:
    A `dm_control.composer.Environment`, which is a `dm_env.Environment`.
    Actions are [4] in [-1, 1]: moves of the set-point along x, y, z (1 is 1 cm
    in 50 ms), and the gripper (below 0 opens, above 0 closes). Observations are
    a dictionary: `flatten`, `successes`, `conditions` read it.

  Raises:
    ValueError: an unknown task, option or value, with the valid ones; frames
      where no pictures can be made.
  """
  from lfgp_dmc import tasks

  return tasks.load(task, seed=seed, **options)


class StoredPolicy:
  """A trained policy: called with an observation, one of its intentions acts.

  Attributes:
    intentions: their names, the main task's first.
    intention: the name of the one that acts unless a call names another.
    load_options: what `load` needs so that the environment is as in training:
      `control_hz`, and for a policy from pixels `observations`, `camera_size`.
  """

  def __init__(
    self, policy: Any, intention: str, load_options: Mapping[str, Any]
  ):
    """Wraps an `agents.policy.Policy`; `load_policy` does it."""
    self._policy = policy
    self.intentions: tuple[str, ...] = policy.tasks
    self.intention = intention
    self.load_options = dict(load_options)

  def __call__(
    self, observation: np.ndarray, intention: str | None = None
  ) -> np.ndarray:
    """The mean action: float32 [O] or [B, O] -> [A] or [B, A], in [-1, 1].

    Raises:
      ValueError: there is no such intention (the message lists them), or
        observations have another width.
      TypeError: it is no array, such as the whole timestep.
    """
    if isinstance(observation, Mapping | dm_env.TimeStep):
      raise TypeError(
        f"observation is a {type(observation).__name__}; valid: what "
        "lfgp_dmc.flatten makes of timestep.observation"
      )
    return self._policy.act(observation, intention or self.intention)


def load_policy(
  run_folder: str | os.PathLike[str], task: str | None = None
) -> StoredPolicy:
  """Loads a trained policy as a plain function.

  Args:
    run_folder: `runs/NAME`, or a policy folder (`config.json` and
      `policy.safetensors`).
    task: which of its intentions acts; None is its main task.

  Returns:
    A function from an observation, float32 [O], to an action, float32 [A].

  Raises:
    ValueError: the folder holds no policy, a file is damaged, or the policy has
      no intention of that name; the message names the file, or lists the
      intentions.
  """
  from lfgp_dmc.agents.policy import Policy
  from lfgp_dmc.runs.run_folder import read_config

  policy = Policy.load(os.fspath(run_folder))
  task = policy.tasks[0] if task is None else task
  if task not in policy.tasks:
    raise ValueError(
      f"{os.fspath(run_folder)} has no intention {task!r}; it has: "
      f"{', '.join(policy.tasks)}"
    )
  config = read_config(run_folder)
  options = {"control_hz": config.get("control_hz", 20)}
  if policy.frame_shape and not config.get("environment"):
    size = config["camera_size"]
    options |= {"observations": "vision", "camera_size": size}
  return StoredPolicy(policy, task, options)
