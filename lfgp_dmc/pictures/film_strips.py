"""Film strips: an episode, played or recorded, as a row of frames."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from absl import logging

from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.pictures import recorder
from lfgp_dmc.pictures.recorder import Clip, Look


def row(
  play: Callable[..., Clip],
  task: str,
  seeds: Sequence[int],
  look: Look,
  columns: int,
) -> tuple[list[np.ndarray], int, int]:
  """Searches for a success and shows it, evenly from the reset on.

  `play` is a function of seed and look, and the limits of `recorder.record`.

  Returns:
    As many frames as columns, uint8 [height, width, 3]; the seed and the
    control step of the success.

  Raises:
    ValueError: no episode succeeded.
  """
  blind = dataclasses.replace(look, every=0)
  for seed in seeds:
    clip = play(seed, blind, until_success_of=task)
    if task in clip.first_success:
      break
    logging.info("no success of %s with seed %d", task, seed)
  else:
    raise ValueError(f"no success of {task} in {len(seeds)} episodes")
  success = clip.first_success[task]
  clip = play(seed, dataclasses.replace(look, every=1), max_steps=success)
  steps = np.linspace(0, success, columns).round().astype(int)
  return [clip.frames[step * clip.checks] for step in steps], seed, success


def states(data: Demonstrations, columns: int) -> np.ndarray:
  """States of the first successful attempt (or the first), evenly spaced.

  Returns:
    float32 [columns, O], from its first observation to its last.
  """
  attempt = data.episode[np.argmax(data.is_last)]
  rows = np.flatnonzero(data.episode == attempt)
  all_states = np.concatenate(
    [data.observation[rows], data.next_observation[rows[-1:]]]
  )
  return all_states[np.linspace(0, len(rows), columns).round().astype(int)]


def of_states(
  environment: Any, observations: np.ndarray, look: Look
) -> list[np.ndarray]:
  """Puts the block world into recorded states, at rest, and draws each.

  Args:
    environment: of a block task.
    observations: float32 [columns, 59].
    look: how frames are made.

  Returns:
    Frames, uint8 [height, width, 3].

  Raises:
    ValueError: a state cannot be shown, such as a TCP out of reach.
  """
  recorder.prepare(environment, look)
  frames = []
  for row in observations:
    opening = float(np.clip(row[6:8].mean(), 0, 1))
    environment.reset_to(row[0:3], row[12:19], row[19:26], opening)
    frames.append(
      environment.physics.render(look.height, look.width, camera_id=look.camera)
    )
  return frames
