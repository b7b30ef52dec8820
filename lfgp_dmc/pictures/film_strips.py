"""Film strips: a successful episode as a row of frames."""

from collections.abc import Callable, Sequence

import numpy as np
from absl import logging

from lfgp_dmc.pictures.recorder import Clip


def row(
  play: Callable[..., Clip], task: str, seeds: Sequence[int], columns: int
) -> tuple[list[np.ndarray], int, int]:
  """Searches for a success and shows it, evenly from the reset on.

  Args:
    play: a function of `seed`, `every` (see `Look`; default 0), `max_steps`
      and `until_success_of`.
    task: the task to succeed in.
    seeds: of the episodes to try, in this order.
    columns: frames in the row.

  Returns:
    The frames, uint8 [height, width, 3]; the seed and the control step of the
    success.

  Raises:
    ValueError: no episode succeeded.
  """
  for seed in seeds:
    clip = play(seed, until_success_of=task)
    if task in clip.first_success:
      break
    logging.info("no success of %s with seed %d", task, seed)
  else:
    raise ValueError(f"no success of {task} in {len(seeds)} episodes")
  success = clip.first_success[task]
  clip = play(seed, every=1, max_steps=success)
  steps = np.linspace(0, success, columns).round().astype(int)
  return [clip.frames[step * clip.checks] for step in steps], seed, success
