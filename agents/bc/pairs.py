"""Expert pairs for supervised learning: split once, shuffled each epoch."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from lfgp_dmc.agents.batches import ExpertBatch
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.data.demonstrations import Demonstrations


class SplitPairs:
  """Each task's pairs on the device, split for training and validation.

  The split is by rows, not by episodes, as in the paper ("dividing each expert
  buffer into a 70%/30% split"): a validation row has neighbours in time among
  the training rows.
  """

  def __init__(
    self,
    demonstrations: Mapping[str, Demonstrations],
    tasks: Sequence[str],
    standardiser: Standardiser,
    validation_share: float,
    generator: np.random.Generator,
  ):
    """Copies the pairs to the standardiser's device and splits them.

    Raises:
      ValueError: a task has fewer than two pairs.
    """
    few = [task for task in tasks if len(demonstrations[task].action) < 2]
    if few:
      raise ValueError(f"fewer than 2 pairs of {', '.join(few)}: no split")
    self._device = device = standardiser.mean.device
    observations, actions, offset = [], [], 0
    self.train_rows: list[np.ndarray] = []  # of the pool, by task
    self.validation_rows: list[np.ndarray] = []
    for task in tasks:
      part = demonstrations[task]
      observations.append(_tensor(part.observation, device))
      actions.append(_tensor(part.action, device))
      size = len(part.action)
      held_out = min(max(round(validation_share * size), 1), size - 1)
      rows = offset + generator.permutation(size)
      self.validation_rows.append(np.sort(rows[:held_out]))
      self.train_rows.append(np.sort(rows[held_out:]))
      offset += size
    self._action = torch.cat(actions)
    self._inputs = self._prepared(torch.cat(observations), standardiser)

  def _prepared(self, observation, standardiser: Standardiser) -> torch.Tensor:
    """What is kept of observations [N, O]."""
    return standardiser(observation)

  def shuffled(
    self, generator: np.random.Generator, batch_size: int
  ) -> torch.Tensor:
    """Draws one epoch: every training row of the largest task once.

    What is missing to a whole last batch, or to a smaller task, is filled up
    from the start of the task's own order. The rows are int64 [updates, K, B].
    """
    updates = -(-max(map(len, self.train_rows)) // batch_size)
    order = np.stack(
      [
        np.resize(generator.permutation(rows), updates * batch_size)
        for rows in self.train_rows
      ]
    ).reshape(len(self.train_rows), updates, batch_size)
    index = torch.from_numpy(order.swapaxes(0, 1).copy())
    return index.to(self._device)

  def batch(
    self, rows: torch.Tensor, generator: np.random.Generator | None = None
  ) -> ExpertBatch:
    """Gathers rows [K, B] of the pool; `generator` is for augmentation."""
    return ExpertBatch(_gather(self._inputs, rows), _gather(self._action, rows))

  def validation(self, index: int) -> ExpertBatch:
    """All validation pairs of task `index`: [1, N, ...]."""
    rows = torch.from_numpy(self.validation_rows[index]).to(self._device)
    return self.batch(rows[None])


def _tensor(array: np.ndarray, device: torch.device) -> torch.Tensor:
  return torch.from_numpy(np.asarray(array, np.float32)).to(device)


def _gather(table: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
  """Rows [K, B] of a table [N, F]: [K, B, F]; faster than indexing."""
  return table.index_select(0, rows.flatten()).view(*rows.shape, -1)
