"""What demonstrations hold, in words: a look before training."""

import numpy as np

from lfgp_dmc.data.demonstrations import Demonstrations

_AT_BOUND = 0.99  # |a| from which an action counts as one at its bound
_FAINT = 0.2  # largest |a| that suggests another unit


def describe(task: str, data: Demonstrations) -> str:
  """A task's attempts, their lengths, successes, rate and actions; 4 lines."""
  lengths = np.unique(data.episode, return_counts=True)[1]
  at_bound = 100 * (np.abs(data.action) >= _AT_BOUND).mean(axis=0)
  return "\n".join(
    [
      f"{task}: {len(data)} pairs in {len(lengths)} attempts of {lengths.min()}"
      f" to {lengths.max()} steps (median {np.median(lengths):g})",
      f"  rows of success: {data.is_last.sum()}; control rate: "
      f"{data.attributes['control_hz']:g} Hz; expert: "
      f"{data.attributes['expert']}",
      f"  actions: from {_numbers(data.action.min(axis=0), '6.2f')}\n"
      f"             to {_numbers(data.action.max(axis=0), '6.2f')}",
      f"      at bounds {_numbers(at_bound, '4.0f', ' %')}",
    ]
  )


def doubts(data: Demonstrations) -> list[str]:
  """What the loader accepts but is seldom meant, one phrase each."""
  found = []
  if not data.is_last.any():
    found.append("no row of success ('is_last')")
  largest = np.abs(data.action).max(axis=0)
  if (largest < _FAINT).any():
    found.append(
      f"|a| stays below {_FAINT} in dimension {int(np.argmin(largest))}: is "
      "the action in units of its bound?"
    )
  same = data.episode[1:] == data.episode[:-1]
  jumps = same & (data.observation[1:] != data.next_observation[:-1]).any(1)
  if jumps.any():
    found.append(
      f"{jumps.sum()} rows do not start where the row before ended, first "
      f"row {int(np.argmax(jumps)) + 1}"
    )
  return found


def _numbers(values: np.ndarray, form: str, unit: str = "") -> str:
  return " ".join(f"{value:{form}}{unit}" for value in values)
