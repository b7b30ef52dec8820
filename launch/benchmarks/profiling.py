"""Where an update's time goes, and the matrix products that it makes."""

import contextlib
import functools
import os
import time
from collections.abc import Callable
from unittest import mock

import torch
from torch.profiler import ProfilerActivity, profile, record_function
from torch.utils._python_dispatch import TorchDispatchMode

_UPDATES = 10  # that are profiled
_BEST_OF = 20
_PRODUCTS = {"mm", "addmm", "addmm_", "bmm", "baddbmm", "baddbmm_"}
_OPTIMISERS = ("_fused_adam", "lerp_", "linalg_vector_norm")
_COPIES = {"copy_", "cat", "clone", "_to_copy", "index_select", "index"}

PARTS = (
  "sampling",
  "forward",
  "backward",
  "optimisers",
  "copies",
  "metrics",
  "rest",
)


def time_shares(agent) -> dict[str, float]:
  """How an update's time is divided: part -> share.

  By torch's profiler, whose own time is in `rest`, as are Python's and all
  outside torch. `copies` are those of forward and backward passes.
  """
  parts = {
    "sampling": (agent.batches, "draw"),
    "metrics": (agent._meter, "add"),
    "backward": (torch.autograd, "grad"),
  }
  os.environ.setdefault("KINETO_LOG_LEVEL", "99")  # no lines for its makers
  with contextlib.ExitStack() as stack:
    for part, (owner, name) in parts.items():
      ranged = record_function(part)(getattr(owner, name))
      stack.enter_context(mock.patch.object(owner, name, ranged))
    found = stack.enter_context(
      profile(activities=[ProfilerActivity.CPU], acc_events=True)
    )
    start = time.perf_counter()
    for _ in range(_UPDATES):
      agent.update()
    total = time.perf_counter() - start
  spent = dict.fromkeys(PARTS, 0.0)
  for event in found.events():
    spent[_part(event)] += 1e-6 * event.self_cpu_time_total
  spent["rest"] = total - sum(spent.values())
  return {part: value / total for part, value in spent.items()}


def _part(event) -> str:
  name, within = event.name.removeprefix("aten::"), set()
  while event is not None:
    within.add(event.name)
    event = event.cpu_parent
  for part in ("sampling", "metrics"):
    if part in within:
      return part
  if name.startswith(_OPTIMISERS):
    return "optimisers"
  if name in _COPIES:
    return "copies"
  return "backward" if "backward" in within else "forward"


def product_rate(agent) -> float:
  """Operations a second of an update's own matrix products, each at its best.

  Each is repeated by itself, on the same operands.
  """
  with _Products() as products:
    agent.update()
  operations = seconds = 0.0
  for call, size, count in products.calls.values():
    operations += size * count
    seconds += best_time(call) * count
  return operations / seconds


def best_time(call: Callable[[], object]) -> float:
  """The least seconds that a call takes."""
  best = float("inf")
  for _ in range(_BEST_OF):
    start = time.perf_counter()
    call()
    best = min(best, time.perf_counter() - start)
  return best


class _Products(TorchDispatchMode):
  """Collects the matrix products that are made while it is the mode."""

  def __init__(self):
    super().__init__()
    # By kind and shapes: the call, its operations, how often it was made.
    self.calls: dict[tuple, tuple[Callable, int, int]] = {}

  def __torch_dispatch__(self, func, types, args=(), kwargs=None):
    del types
    result = func(*args, **(kwargs or {}))
    if func._opname in _PRODUCTS:
      left, right = args[-2:]
      key = (func, left.shape, left.stride(), right.shape, right.stride())
      size = 2 * left.numel() * right.shape[-1]
      _, _, count = self.calls.get(key, (None, 0, 0))
      call = functools.partial(func, *args, **(kwargs or {}))
      self.calls[key] = (torch.no_grad()(call), size, count + 1)
    return result
