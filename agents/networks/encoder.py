"""From frames to features: a small convolutional network, and random shifts.

Keypoints (Finn et al., 2016, "Deep spatial autoencoders for visuomotor
learning"): each channel of the last layer becomes a probability over the
picture's places, and its mean place is what goes on. Random shifts as in DrQ
(Kostrikov et al., 2020).
"""

from collections.abc import Sequence

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from lfgp_dmc.agents import serialisation, vision
from lfgp_dmc.agents.networks.linear import initialise_, make_linear
from lfgp_dmc.agents.policy import Policy

_SMALLEST = 32  # pixels a side, which leave the last layer 4 x 4 places


class Encoder(nn.Module):
  """All cameras' frames -> F features in [-1, 1]."""

  def __init__(
    self,
    frame_shape: Sequence[int],
    features: int,
    channels: int,
    generator: torch.Generator,
  ):
    """Draws the weights, which the cameras share up to the keypoints.

    Args:
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
    self.frame_shape = tuple(frame_shape)
    cameras, *sides, inputs = self.frame_shape
    self.layers = nn.ModuleList()
    for kernel, stride in vision.LAYERS:
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


def frozen(policy: Policy) -> Encoder:
  """The encoder of a policy from pixels, which nothing trains."""
  options, generator = policy.options(), torch.Generator()
  sizes = options["features"], options["channels"]
  encoder = Encoder(policy.frame_shape, *sizes, generator)
  arrays = policy.arrays()
  kept = {k: arrays[f"encoder.{k}"] for k in encoder.state_dict()}
  serialisation.load_module_state(encoder, kept, "the policy's encoder")
  return encoder.requires_grad_(False)
