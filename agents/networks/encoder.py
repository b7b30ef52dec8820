"""From frames to features: a small convolutional network, and random shifts.

Keypoints (Finn et al., 2016, "Deep spatial autoencoders for visuomotor
learning"): each channel of the last layer becomes a probability over the
picture's places, and its mean place is what goes on. Random shifts as in DrQ
(Kostrikov et al., 2020).
"""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents.fields import Count, PositiveInt, checked
from lfgp_dmc.agents.networks.linear import initialise_, make_linear

# Side of the kernel, stride of each layer.
_LAYERS = ((5, 2), (3, 2), (3, 1))
_ROWS = 256  # encoded at a time
_SMALLEST = 32  # pixels a side, which leave the last layer 4 x 4 places


@checked
class EncoderConfig:
  """How frames are seen; of no effect without cameras."""

  features: PositiveInt = 64  # F
  channels: PositiveInt = 32  # of each layer
  shift: Count = 4  # pixels, at most, of random shifts in training


class Encoder(nn.Module):
  """All cameras' frames -> F features in [-1, 1]."""

  def __init__(
    self,
    floats: int,
    frame_shape: Sequence[int],
    features: int,
    channels: int,
    generator: torch.Generator,
  ):
    """Draws the weights, which the cameras share up to the keypoints.

    Args:
      floats: of an observation, before the pixels.
      frame_shape: [C, H, W, 3].
      features: F.
      channels: of each convolution.
      generator: of the weights.

    Raises:
      ValueError: frames are too small.
    """
    super().__init__()
    if min(frame_shape[1:3]) < _SMALLEST:
      raise ValueError(
        f"frames have shape {list(frame_shape)}; valid: sides of {_SMALLEST} "
        "pixels or more"
      )
    self.floats, self.frame_shape = floats, tuple(frame_shape)
    self.channels, self.features = channels, features
    cameras, *sides, inputs = self.frame_shape
    self.layers = nn.ModuleList()
    for kernel, stride in _LAYERS:
      self.layers.append(_conv(inputs, channels, kernel, stride, generator))
      inputs = channels
      sides = [(side - kernel) // stride + 1 for side in sides]
    # Inverse temperatures of the keypoints; of 1, all begin in the middle.
    self.sharpness = nn.Parameter(torch.full((channels, 1), 10.0))
    self.output = make_linear(2 * cameras * channels, features, generator)
    self.norm = nn.LayerNorm(features)
    places = [torch.linspace(-1, 1, side) for side in sides]
    grid = torch.stack(torch.meshgrid(*places, indexing="ij"), -1)
    self.register_buffer("_places", grid.view(-1, 2), persistent=False)
    self._places: torch.Tensor  # [places, 2]

  @property
  def observation_size(self) -> int:
    """Floats of a flat observation with its pixels."""
    return self.floats + int(np.prod(self.frame_shape))

  @property
  def output_size(self) -> int:
    """Floats of an observation with features instead."""
    return self.floats + self.features

  def forward(self, frames: torch.Tensor) -> torch.Tensor:
    """Features [B, F] of frames [B, C, H, W, 3], 0 to 255, in their dtype."""
    _, height, width, _ = self.frame_shape
    hidden = frames.reshape(-1, height, width, 3).permute(0, 3, 1, 2)
    hidden = hidden / 127.5 - 1.0
    for layer in self.layers:
      hidden = layer(hidden).relu_()
    shares = (hidden.float().flatten(2) * self.sharpness).softmax(-1)
    keypoints = (shares @ self._places).view(len(frames), -1)
    return torch.tanh(self.norm(self.output(keypoints)))

  def observe(self, flat: torch.Tensor) -> torch.Tensor:
    """Observations with pixels [B, ...] -> with features [B, output_size]."""
    own, pixels = flat.split((self.floats, flat.shape[1] - self.floats), 1)
    frames = pixels.reshape(-1, *self.frame_shape)
    return torch.cat([own, self(frames)], 1)


class _Conv(nn.Conv2d):
  """Computes in its inputs' dtype, like `linear.Linear`."""

  bias: torch.Tensor

  def forward(self, inputs: torch.Tensor) -> torch.Tensor:
    dtype = inputs.dtype
    weight, bias = self.weight.to(dtype), self.bias.to(dtype)
    return functional.conv2d(inputs, weight, bias, self.stride)


def _conv(inputs, outputs, kernel, stride, generator) -> _Conv:
  layer: _Conv = nn.utils.skip_init(_Conv, inputs, outputs, kernel, stride)
  fan_in = inputs * kernel**2
  initialise_(layer.weight, fan_in, generator)
  initialise_(layer.bias, fan_in, generator)
  return layer


def shifted(
  frames: np.ndarray, most: int, generator: np.random.Generator
) -> np.ndarray:
  """Each frame [..., H, W, 3] shifted by up to `most` pixels either way.

  What moves in repeats the edge.
  """
  if not most:
    return frames
  *_, height, width, colours = frames.shape
  flat = frames.reshape(-1, height, width, colours)
  border = (most, most)
  padded = np.pad(flat, ((0, 0), border, border, (0, 0)), mode="edge")
  moved = np.empty_like(flat)
  offsets = generator.integers(2 * most + 1, size=(len(flat), 2)).tolist()
  for i, (y, x) in enumerate(offsets):
    moved[i] = padded[i, y : y + height, x : x + width]
  return moved.reshape(frames.shape)


def as_function(encoder: Encoder) -> Callable[[np.ndarray], np.ndarray]:
  """The frozen encoder: frames uint8 [N, C, H, W, 3] -> float32 [N, F]."""
  encoder.requires_grad_(False)

  def encode(frames: np.ndarray) -> np.ndarray:
    device = encoder.output.weight.device
    made = np.empty((len(frames), encoder.features), np.float32)
    with torch.inference_mode():
      for start in range(0, len(frames), _ROWS):
        some = torch.from_numpy(np.array(frames[start : start + _ROWS]))
        features = encoder(some.to(device).float())
        made[start : start + _ROWS] = features.cpu().numpy()
    return made

  return encode
