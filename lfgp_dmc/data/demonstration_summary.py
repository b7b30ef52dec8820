"""What demonstrations hold, in words: a look before training."""

from collections.abc import Mapping

import numpy as np

from lfgp_dmc.data.demonstrations import Demonstrations

_FAINT = 0.2  # largest |a| that suggests another unit


def table(found: Mapping[str, Demonstrations]) -> str:
  """A plain-text table of what a dataset holds, one row a task.

  Columns: pairs; attempts, and how many end in a row of success; the median and
  the most steps of an attempt; the share of action values beyond 0.95; and the
  least and the greatest value of each dimension of the action.
  """
  rows = [
    f"{'task':<16}{'pairs':>7}{'attempts':>9}{'success':>8}{'median':>7}"
    f"{'most':>5}{'|a|>.95':>8}  actions from:to"
  ]
  for task, data in found.items():
    lengths = np.unique(data.episode, return_counts=True)[1]
    ranges = [f"{a.min():.2f}:{a.max():.2f}" for a in data.action.T]
    rows.append(
      f"{task:<16}{len(data):>7}{len(lengths):>9}{data.is_last.sum():>8}"
      f"{np.median(lengths):>7g}{lengths.max():>5}"
      f"{(np.abs(data.action) > 0.95).mean():>8.1%}  {' '.join(ranges)}"
    )
  return "\n".join(rows)


def doubts(data: Demonstrations) -> list[str]:
  """What the loader accepts but is seldom meant, a phrase each."""
  found = []
  if not data.is_last.any():
    found.append("no row of success ('is_last')")
  largest = np.abs(data.action).max(axis=0)
  if (largest < _FAINT).any():
    found.append(
      f"|a| stays below {_FAINT} in dimension {np.argmin(largest)}: is the "
      "action in units of its bound?"
    )
  if rows := jumps(data):
    found.append(
      f"{len(rows)} rows do not start where the row before ended, first row "
      f"{rows[0]}"
    )
  return found


def jumps(data: Demonstrations) -> list[int]:
  """Rows that do not start where the row before, of their attempt, ended."""
  same = data.episode[1:] == data.episode[:-1]
  differ = data.next_observation[:-1] != data.observation[1:]
  return list(1 + np.flatnonzero(same & differ.any(axis=1)))
