"""What every agent is built from, beside its config."""

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # torch and h5py are loaded when an agent is built
  import torch

  from lfgp_dmc.agents.networks.encoder import Encoder
  from lfgp_dmc.data.demonstrations import Demonstrations
  from lfgp_dmc.data.replay import Replay


@dataclasses.dataclass(frozen=True, kw_only=True)
class AgentParts:
  """The same for all algorithms; each takes what it needs."""

  tasks: tuple[str, ...]  # that are learned, the main task first
  demonstrations: "Mapping[str, Demonstrations]"  # of each; may be empty
  replay: "Replay | None"  # which the training loop fills; cloning has none
  seed: int  # all random numbers follow from it
  device: "torch.device | str"
  observation_size: int  # O; of cloning from pixels, without them
  action_size: int  # A
  bfloat16: bool = False  # whether products are; parameters stay float32
  threads: int = 1  # of two on the CPU, one trains discriminators
  cuda_graphs: bool = True  # whether a GPU records updates, then replays them
  frame_shape: tuple[int, ...] = ()  # [C, H, W, 3], where cloning sees frames
  # The frozen one that has made the features of all observations; it is stored
  # with the intentions.
  encoder: "Encoder | None" = None
