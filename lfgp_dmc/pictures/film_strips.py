"""Film strips: a successful episode as a row of frames."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from absl import logging

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
