"""Losses as pure functions: tensors in, `(loss, metrics)` out.

Metrics are detached tensors, `[K]` for what differs by task, else scalars.
"""

import torch

Metrics = dict[str, torch.Tensor]
