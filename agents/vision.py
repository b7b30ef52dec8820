"""From frames to features without torch: an encoder's settings, and acting.

`networks/encoder.py` trains the same network.
"""

from collections.abc import Callable, Sequence

import numpy as np

from lfgp_dmc.agents.fields import Count, PositiveInt, checked

# Side of the kernel, stride of each layer.
LAYERS = ((5, 2), (3, 2), (3, 1))


@checked
class EncoderConfig:
  """How frames are seen; of no effect without cameras."""

  features: PositiveInt = 64  # F
  channels: PositiveInt = 32  # of each layer
  shift: Count = 4  # pixels, at most, of random shifts in training


def shapes(
  frame_shape: Sequence[int], features: int, channels: int
) -> dict[str, tuple[int, ...]]:
  """Of an encoder's arrays by name, for frames [C, H, W, 3]."""
  cameras, _, _, inputs = frame_shape
  found: dict[str, tuple[int, ...]] = {"sharpness": (channels, 1)}
  for i, (side, _) in enumerate(LAYERS):
    found[f"layers.{i}.weight"] = (channels, inputs, side, side)
    found[f"layers.{i}.bias"] = (channels,)
    inputs = channels
  found["output.weight"] = (features, 2 * cameras * channels)
  for name in ("output.bias", "norm.weight", "norm.bias"):
    found[name] = (features,)
  return {f"encoder.{name}": shape for name, shape in found.items()}


def encode(read: Callable[[str], np.ndarray], frames: np.ndarray) -> np.ndarray:
  """Features, float32 [N, F] in [-1, 1], of frames [N, C, H, W, 3], 0 to 255.

  `read` returns an array by its name in `shapes`. One row after the other: no
  slower, and none depends on the others.
  """
  return np.stack([_encode(read, of_cameras) for of_cameras in frames])


def _encode(read, frames: np.ndarray) -> np.ndarray:
  """What `networks.encoder.Encoder` computes: [C, H, W, 3] -> [F]."""
  hidden = frames / np.float32(127.5) - 1
  for i, (side, stride) in enumerate(LAYERS):
    weight = read(f"encoder.layers.{i}.weight").transpose(2, 3, 1, 0)
    windows = np.lib.stride_tricks.sliding_window_view(
      hidden, (side, side), (1, 2)
    )[:, ::stride, ::stride]
    windows = np.moveaxis(windows, 3, -1)  # [C, H', W', side, side, inputs]
    hidden = np.tensordot(windows, weight, 3) + read(f"encoder.layers.{i}.bias")
    hidden = np.maximum(hidden, 0)
  logits = hidden.reshape(len(hidden), -1, hidden.shape[-1]).swapaxes(1, 2)
  logits = logits * read("encoder.sharpness")
  shares = np.exp(logits - logits.max(-1, keepdims=True))
  shares /= shares.sum(-1, keepdims=True)
  places = [np.linspace(-1, 1, n, dtype=np.float32) for n in hidden.shape[1:3]]
  grid = np.stack(np.meshgrid(*places, indexing="ij"), -1).reshape(-1, 2)
  keypoints = (shares @ grid).ravel()
  row = read("encoder.output.weight") @ keypoints + read("encoder.output.bias")
  row = (row - row.mean()) / np.sqrt(row.var() + 1e-5)
  row = row * read("encoder.norm.weight") + read("encoder.norm.bias")
  return np.tanh(row)
