"""Features in the place of frames, made by the encoder of a clone."""

import dataclasses
import pathlib

import numpy as np

from lfgp_dmc import progress_bars
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data import files
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs import run_folder

_FRAMES = 256  # that are encoded at a time


def clone_of(
  config: RunConfig, folder: pathlib.Path | None, shape: tuple[int, ...]
) -> Policy:
  """Whose encoder is used: the run's own policy, or what it starts from.

  Args:
    config: of the run.
    folder: the run's, if there is one.
    shape: of the environment's frames, [C, H, W, 3].

  Raises:
    UserError: there is none, or it sees other frames or none.
  """
  if not config.init_from:
    raise UserError(
      "config.init_from is not set: from pixels, give the folder of a clone, "
      "whose encoder is used: train one by --preset=pixels "
      "--config.algorithm=multitask_bc (or bc, for dac)"
    )
  source: files.Path = config.init_from
  if folder is not None and (folder / run_folder.ARRAYS_NAME).exists():
    source = folder
  with command.checked_input():
    policy = Policy.load(source)
  if not policy.frame_shape:
    raise UserError(f"config.init_from: {config.init_from} sees no pixels")
  if policy.frame_shape != shape:
    raise UserError(
      f"config.init_from: {config.init_from} sees frames "
      f"{list(policy.frame_shape)}; the environment has {list(shape)}"
    )
  return policy


def with_features(
  task: str, data: Demonstrations, clone: Policy
) -> Demonstrations:
  """Demonstrations of a task with features [N, F] beside their floats."""
  frames = data.frames
  assert frames is not None, "they were checked"
  parts = []
  with progress_bars.bar(
    total=len(frames), desc=f"encoding {task}", unit="frame"
  ) as bar:
    for start in range(0, len(frames), _FRAMES):
      parts.append(clone.encode(frames[start : start + _FRAMES]))
      bar.update(len(parts[-1]))
  features, rows = np.concatenate(parts), data.frame_rows()
  return dataclasses.replace(
    data,
    observation=np.hstack([data.observation, features[rows]]),
    next_observation=np.hstack([data.next_observation, features[rows + 1]]),
  )
