"""Film strips: a successful episode, played or recorded, as frames in a row."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from absl import logging

from lfgp_dmc import observations
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


def recorded(
  environment: Any, data: Demonstrations, look: Look, columns: int
) -> list[np.ndarray]:
  """Shows the first attempt that succeeded (or the first), evenly.

  The block world is put, at rest, into the states that were recorded.

  Returns:
    As many frames as columns, uint8 [height, width, 3].

  Raises:
    ValueError: a state cannot be shown, such as a TCP out of reach.
  """
  recorder.prepare(environment, look)
  rows = np.flatnonzero(data.episode == data.episode[np.argmax(data.is_last)])
  states = [*data.observation[rows], data.next_observation[rows[-1]]]
  frames = []
  for step in np.linspace(0, len(rows), columns).round().astype(int):
    part = observations.components(states[step])
    places = part["block_positions"].reshape(2, 3)
    rotations = part["block_rotations"].reshape(2, 4)
    opening = np.clip(part["finger_positions"][:2].mean(), 0, 1)
    environment.reset_to(
      part["ee_position"], *np.hstack([places, rotations]), float(opening)
    )
    frames.append(
      environment.physics.render(look.height, look.width, camera_id=look.camera)
    )
  return frames
