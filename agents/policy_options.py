"""What a stored policy is: its options, and its arrays by name and shape."""

import dataclasses
from typing import Annotated

from pydantic import Field

from lfgp_dmc.agents import fields, vision
from lfgp_dmc.agents.fields import NetworksConfig

MEAN, STD = "standardiser.mean", "standardiser.deviation"
HEADS, OUTPUT = "heads.", "heads.output"
SECOND = "heads.second"  # of the layout without a trunk
# With ReLU, in order, those that there are.
HIDDEN = ("trunk.first", "trunk.second", "heads.hidden", SECOND)


@fields.checked
class PolicyOptions(NetworksConfig):
  """What goes with a policy's arrays."""

  tasks: Annotated[list[fields.Text], Field(min_length=1)]
  observation_size: fields.PositiveInt
  action_size: fields.PositiveInt
  tanh_feature_scale: fields.NonNegative = 0.0
  # Of an encoder: [C, H, W, 3] of frames, of which it makes the last features
  # of an observation, and its channels.
  frame_shape: Annotated[
    list[fields.PositiveInt], Field(min_length=4, max_length=4)
  ] = dataclasses.field(default_factory=list)  # empty: there is none
  features: fields.Count = 0
  channels: fields.Count = 0
  env_step: fields.Count = 0  # how long it was trained

  def shapes(self) -> dict[str, tuple[int, ...]]:
    """Of the arrays by name: a network's own."""
    size, hidden, tasks = self.observation_size, self.hidden_size, self.tasks
    inputs = size * (2 if self.tanh_feature_scale else 1)
    shapes: dict[str, tuple[int, ...]] = {MEAN: (size,), STD: (size,)}
    widths = {"heads.hidden": inputs, SECOND: hidden}
    if self.layout == "shared_trunk":
      for name, width in (("trunk.first", inputs), ("trunk.second", hidden)):
        shapes |= {f"{name}.weight": (hidden, width), f"{name}.bias": (hidden,)}
      widths = {"heads.hidden": hidden}
    for name, width in (*widths.items(), (OUTPUT, hidden)):
      out = 2 * self.action_size if name == OUTPUT else hidden
      shapes[f"{name}.weight"] = (len(tasks), width, out)
      shapes[f"{name}.bias"] = (len(tasks), 1, out)
    if self.frame_shape:
      shapes |= vision.shapes(self.frame_shape, self.features, self.channels)
    return shapes
