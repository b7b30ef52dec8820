"""The policy of a network that may go on being trained."""

from collections.abc import Sequence

import numpy as np

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.networks.intentions import IntentionNetwork
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.agents.policy_options import HEADS


class NetworkPolicy(Policy):
  """Acts by the parameters that a network has at that moment."""

  def __init__(self, network: IntentionNetwork, tasks: Sequence[str]):
    self._network = network
    self._tensors = network.state_dict(keep_vars=True)  # not copied
    scale = network.standardiser.tanh_feature_scale
    seen = () if network.encoder is None else network.encoder.frame_shape
    super().__init__(self._tensors, tasks, scale, seen)

  def arrays(self) -> dict[str, np.ndarray]:
    """See `Policy.arrays`."""
    return serialisation.module_state(self._network)

  def _read(self, name: str, index: int = 0) -> np.ndarray:
    tensor = self._tensors[name].detach()
    if name.startswith(HEADS):
      tensor = tensor[index]
    return tensor.cpu().numpy()
