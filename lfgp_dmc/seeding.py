"""One seed in, independent random streams out."""

import numpy as np


def derive(seed: int, *path: int | str) -> int:
  """A 32-bit seed that depends on `seed` and `path` alone.

  Args:
    seed: the user's, 0 or more.
    *path: what the stream is for, such as ("evaluation", 3).
  """
  words = [seed]
  for part in path:
    if isinstance(part, str):
      words.extend(part.encode())
    else:
      words.append(part)
    words.append(0xFFFFFFFF)  # keeps ("a", 1) apart from ("a1",)
  return int(np.random.SeedSequence(words).generate_state(1)[0])


def generator(seed: int, *path: int | str) -> np.random.Generator:
  """A NumPy generator for the stream `path` of `seed`."""
  return np.random.default_rng(derive(seed, *path))
