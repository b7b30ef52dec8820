"""LfGP-DMC: Learning from Guided Play in dm_control, from one import.

    import lfgp_dmc
    environment = lfgp_dmc.load("stack", seed=0)
    act = lfgp_dmc.load_policy("runs/NAME", "stack")
    timestep = environment.reset()
    action = act(lfgp_dmc.flatten(timestep.observation))

This facade reaches `tasks` and `agents` inside its functions only: importing it
loads neither a simulator nor torch.
"""

import os
from collections.abc import Callable
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
  """Builds the environment of one of the nine tasks.

  Args:
    task: a name in `ALL_TASKS`.
    seed: fixes everything random in the environment; None draws a fresh seed.
    **options: `reward` ("sparse" or "dense"), `observations` ("features",
      "vision" or "all"), `camera_size` (64), `spawn` ("published" or
      "full_tray"), `control_hz` (20), `time_limit` (18.0 s), `show_rewards`
      (False); see `tasks.load`.

  Returns:
    A `dm_control.composer.Environment`, which is a `dm_env.Environment`.

  Raises:
    ValueError: an unknown task, option or value, with the valid ones; frames
      where no pictures can be made.
  """
  from lfgp_dmc import tasks

  return tasks.load(task, seed=seed, **options)


def load_policy(
  run_folder: str | os.PathLike[str], task: str | None = None, seed: int = 0
) -> Callable[[np.ndarray], np.ndarray]:
  """Loads a trained intention as a plain function.

  Args:
    run_folder: `runs/NAME`, or a policy folder (`config.json` and
      `policy.safetensors`).
    task: which of its intentions acts; None is its main task.
    seed: for policies that draw random numbers; mean actions draw none.

  Returns:
    A callable from an observation, float32 [O], to an action, float32 [A].

  Raises:
    ValueError: the folder holds no policy, or the policy has no intention of
      that name; the message names the file, or lists the intentions.
  """
  from lfgp_dmc.agents.policy import Policy

  policy = Policy.load(os.fspath(run_folder))
  task = policy.tasks[0] if task is None else task
  if task not in policy.tasks:
    raise ValueError(
      f"{os.fspath(run_folder)} has no intention {task!r}; it has: "
      f"{', '.join(policy.tasks)}"
    )
  policy.begin(task, seed)
  return policy.act
