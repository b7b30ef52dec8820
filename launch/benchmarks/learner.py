"""Speed of updates, against what the machine's matrix products reach."""

import dataclasses
import functools
import time
from collections.abc import Callable, Iterator

import numpy as np
import torch
from torch.utils import flop_counter

from agents import synthetic
from launch.configs import ALGORITHMS, RunConfig
from lfgp_dmc import observations, task_names

_ACTION_SIZE = 4
_PAIRS = 2_000  # a task
_ROWS = 20_000  # of the replay
_SIDE = 1_024  # of the square matrices
_DTYPES = {"fp32": torch.float32, "bf16": torch.bfloat16}


def measure(config: RunConfig, seconds: float) -> Iterator[tuple[str, float]]:
  """Measures updates and matrix products, in fp32 and bf16, 1 and 2 threads.

  Args:
    config: whose agent; data are made up.
    seconds: about how long each measurement takes.

  Yields:
    `updates_per_s_fp32_1thread` and so on; `matmul_gflops_...`;
    `gflop_per_update` (matrix products that are executed, 2 per multiply-add);
    `roofline_fraction_...`: the first times the third over the second.
  """
  agents = {
    dtype: make_agent(config, bfloat16=dtype == "bf16") for dtype in _DTYPES
  }
  operations = _operations(agents["fp32"].update)
  yield "gflop_per_update", operations / 1e9
  for threads in (1, 2):
    torch.set_num_threads(threads)
    for name, dtype in _DTYPES.items():
      suffix = f"{name}_{threads}thread{'s' if threads > 1 else ''}"
      updates = rate(agents[name].update, seconds)
      matrix = torch.randn(_SIDE, _SIDE).to(dtype)
      products = rate(functools.partial(torch.mm, matrix, matrix), seconds / 4)
      peak = products * 2 * _SIDE**3
      yield f"updates_per_s_{suffix}", updates
      yield f"matmul_gflops_{suffix}", peak / 1e9
      yield f"roofline_fraction_{suffix}", updates * operations / peak


def make_agent(config: RunConfig, replay=None, bfloat16: bool | None = None):
  """The config's agent on made-up demonstrations.

  Args:
    config: a run's; without warm start.
    replay: where its transitions are; None makes some up.
    bfloat16: overrides the config's.
  """
  changes = {"bc_warm_start_updates": 0}
  if bfloat16 is not None:
    changes["bfloat16"] = bfloat16
  tasks = task_names.task_set(config.main_task)
  size = observations.OBSERVATION_SIZE
  if replay is None:
    rows = synthetic.transitions(_ROWS, size, _ACTION_SIZE)
    rewards = np.zeros((_ROWS, len(tasks)), np.float32)  # for SAC-X
    replay = synthetic.ArrayReplay(rows, rewards, tasks)
  return ALGORITHMS[config.algorithm].build(
    dataclasses.replace(config.agent, **changes),
    tasks,
    synthetic.demonstrations(tasks, _PAIRS, size, _ACTION_SIZE),
    replay,
    config.seed,
    torch.device("cpu"),
    size,
    _ACTION_SIZE,
  )


def rate(call: Callable[[], object], seconds: float) -> float:
  """Calls a second, after three to warm up."""
  for _ in range(3):
    call()
  start, count = time.perf_counter(), 0
  while (elapsed := time.perf_counter() - start) < seconds or not count:
    call()
    count += 1
  return count / elapsed


def _operations(update: Callable[[], object]) -> int:
  with flop_counter.FlopCounterMode(display=False) as counter:
    update()
  return counter.get_total_flops()
