"""What an update takes, as tensors on the device that learns."""

from typing import NamedTuple

import torch


class ExpertBatch(NamedTuple):
  """Each task's own expert rows."""

  inputs: torch.Tensor  # [K, N, O], standardised
  action: torch.Tensor  # [K, N, A]


class Batch(NamedTuple):
  """Transitions shared by all tasks, but for examples of success."""

  inputs: torch.Tensor  # [B, O], standardised
  action: torch.Tensor  # [B, A]
  next_inputs: torch.Tensor  # [B, O], standardised
  stored_reward: torch.Tensor | None = None  # [K, B], where it is stored
  # int64 [B], where there are examples of success: the task that a row is an
  # example of, or -1 for a transition of the replay. Examples come last.
  example_task: torch.Tensor | None = None
  replay_rows: int | None = None  # which come first; None: intentions take all


class Draw(NamedTuple):
  """All that one update of the LfGP learner takes."""

  batch: Batch  # for critics and intentions
  # Where discriminators are to be updated: the replay's and the experts' side.
  policy: Batch | None = None
  expert: ExpertBatch | None = None


def joined(one: Batch, other: Batch) -> Batch:
  """Both batches' transitions, one after the other."""
  return Batch(*map(torch.cat, zip(one[:3], other[:3], strict=True)))
