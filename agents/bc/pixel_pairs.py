"""Expert pairs from pixels: frames stay on disk until a batch needs them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch

from lfgp_dmc.agents.batches import ExpertBatch
from lfgp_dmc.agents.bc.pairs import SplitPairs
from lfgp_dmc.agents.networks import encoder as encoders
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.data.demonstrations import Demonstrations

_ROWS = 256  # of validation that are encoded at a time


class PixelPairs(SplitPairs):
  """Pairs whose inputs carry the gradient of the encoder."""

  def __init__(
    self,
    demonstrations: Mapping[str, Demonstrations],
    tasks: Sequence[str],
    standardiser: Standardiser,
    validation_share: float,
    generator: np.random.Generator,
    encoder: Encoder,
    shift: int,
    dtype: torch.dtype,
  ):
    """As `SplitPairs`; training frames shift by up to `shift` pixels."""
    self._standardiser, self._encoder = standardiser, encoder
    self._shift, self._dtype = shift, dtype
    parts = [demonstrations[task] for task in tasks]
    self._frames: list[Any] = [part.frames for part in parts]
    self._places = [part.frame_rows() for part in parts]
    self._ends = np.cumsum([len(part) for part in parts])
    super().__init__(
      demonstrations, tasks, standardiser, validation_share, generator
    )

  def _prepared(self, observation, standardiser: Standardiser) -> torch.Tensor:
    return observation  # standardised with the features

  def batch(
    self, rows: torch.Tensor, generator: np.random.Generator | None = None
  ) -> ExpertBatch:
    """Gathers rows [K, B], each k of one task; a generator shifts frames."""
    own, action = super().batch(rows)
    frames = np.stack([self._gather(of_task) for of_task in rows.cpu().numpy()])
    if generator is not None:
      frames = encoders.shifted(frames, self._shift, generator)
    pixels = torch.from_numpy(frames).to(self._device).flatten(0, 1)
    features = self._encoder(pixels.to(self._dtype))
    whole = torch.cat([own, features.view(*rows.shape, -1)], dim=-1)
    return ExpertBatch(self._standardiser(whole), action)

  def _gather(self, rows: np.ndarray) -> np.ndarray:
    """Frames of one task's rows of the pool, uint8 [B, C, H, W, 3]."""
    task = int(np.searchsorted(self._ends, rows[0], side="right"))
    first = self._ends[task] - len(self._places[task])
    return self._frames[task][self._places[task][rows - first]]

  def validation(self, index: int) -> ExpertBatch:
    """All validation pairs of task `index`: [1, N, ...]."""
    rows = torch.from_numpy(self.validation_rows[index]).to(self._device)
    parts = [self.batch(part[None]) for part in rows.split(_ROWS)]
    return ExpertBatch(
      *(torch.cat(part, 1) for part in zip(*parts, strict=True))
    )
