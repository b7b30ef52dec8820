"""Means of metrics over updates, read from the device only on demand."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch


class Meter:
  """Sums tensors by name; names and columns are fixed from the start."""

  def __init__(
    self,
    tasks: Sequence[str],
    scalars: Sequence[str],
    by_task: Sequence[str],
    device: torch.device | str = "cpu",
  ):
    """Metrics `by_task` are reported as `name/<task>`."""
    self._tasks = tuple(tasks)
    size = len(self._tasks)
    self._sums = {name: torch.zeros((), device=device) for name in scalars}
    self._sums |= {name: torch.zeros(size, device=device) for name in by_task}
    self._counts = dict.fromkeys(self._sums, 0)

  def add(self, metrics: Mapping[str, torch.Tensor]) -> None:
    """Adds one update's metrics; KeyError for a name not announced."""
    sums = [self._sums[name] for name in metrics]
    torch._foreach_add_(sums, list(metrics.values()))
    for name in metrics:
      self._counts[name] += 1

  def read(self) -> dict[str, float]:
    """Means since the last call, NaN where nothing came; starts anew."""
    means: dict[str, float] = {}
    for name, total in self._sums.items():
      count = self._counts[name]
      sums = total.flatten().tolist()
      values = [value / count if count else math.nan for value in sums]
      by_task = [f"{name}/{task}" for task in self._tasks]
      means |= zip(by_task if total.dim() else [name], values, strict=True)
      total.zero_()
      self._counts[name] = 0
    return means

  def state_dict(self) -> dict[str, Any]:
    """The sums and counts since the last `read`."""
    return {
      "sums": {k: v.cpu().numpy().copy() for k, v in self._sums.items()},
      "counts": dict(self._counts),
    }

  def load_state_dict(self, state: Mapping[str, Any]) -> None:
    """Restores what `state_dict` returned."""
    for name, total in self._sums.items():
      total.copy_(torch.from_numpy(np.array(state["sums"][name])))
      self._counts[name] = int(state["counts"][name])
