"""What a dataset holds, as a table."""

from collections.abc import Mapping

import numpy as np

from lfgp_dmc.data.demonstrations import Demonstrations


def table(demonstrations: Mapping[str, Demonstrations]) -> str:
  """A plain-text table of what a dataset holds, one row a task.

  Columns: pairs; attempts, and how many end in a row of success; the median and
  the most steps of an attempt; the share of action values beyond 0.95; and the
  least and the greatest value of each dimension of the action.
  """
  rows = [
    f"{'task':<16}{'pairs':>7}{'attempts':>9}{'success':>8}{'median':>7}"
    f"{'most':>5}{'|a|>.95':>8}  actions from:to"
  ]
  for task, data in demonstrations.items():
    lengths = np.unique(data.episode, return_counts=True)[1]
    ranges = [f"{a.min():.2f}:{a.max():.2f}" for a in data.action.T]
    rows.append(
      f"{task:<16}{len(data):>7}{len(lengths):>9}{data.is_last.sum():>8}"
      f"{np.median(lengths):>7g}{lengths.max():>5}"
      f"{(np.abs(data.action) > 0.95).mean():>8.1%}  {' '.join(ranges)}"
    )
  return "\n".join(rows)
