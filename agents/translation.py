"""The world shifted in the plane: an attempt elsewhere is an attempt too.

No slot pins Stack, Unstack-Stack or what is learned beside them, and the tray
is flat: rows that are shifted as a whole, by a few centimetres along x and y,
are as true as those that were shown.
"""

import numpy as np
import torch

# The x and y of positions in an observation, and of offsets to what is fixed.
_MOVING = ((0, 1), (12, 13), (19, 20))  # TCP, blue, green
_FIXED = ((47, 48), (50, 51))  # slots from blocks
_LOW = torch.tensor([-0.15, 0.35])  # m, where TCP and blocks may be
_HIGH = torch.tensor([0.15, 0.65])
PINNED = ("bring", "insert")  # tasks whose slots stay where they are


def shifted(
  observation: torch.Tensor,
  following: torch.Tensor,
  reach: np.ndarray,
  generator: np.random.Generator,
) -> tuple[torch.Tensor, torch.Tensor]:
  """Shifts each row, at most so far that all stays within the box.

  Args:
    observation: [..., 59], raw.
    following: [..., 59], what follows, shifted alike.
    reach: [...], greatest shift of each row along x and y, m.
    generator: source of the shifts.

  Returns:
    Both, shifted; copies.
  """
  positions = torch.stack([observation[..., at] for at in _MOVING], dim=-2)
  later = torch.stack([following[..., at] for at in _MOVING], dim=-2)
  both = torch.cat([positions, later], dim=-2)
  most = torch.from_numpy(np.asarray(reach, np.float32))[..., None]
  low = torch.maximum(-most, (_LOW - both.amin(-2)).clamp(max=0.0))
  high = torch.minimum(most, (_HIGH - both.amax(-2)).clamp(min=0.0))
  share = generator.random(low.shape, np.float32)
  shift = low + torch.from_numpy(share) * (high - low)
  results = []
  for part in (observation, following):
    moved = part.clone()
    for at in _MOVING:
      moved[..., at] += shift
    for at in _FIXED:
      moved[..., at] -= shift
    results.append(moved)
  return results[0], results[1]
