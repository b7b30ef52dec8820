"""Speed of updates, against what the machine's matrix products reach."""

import dataclasses
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np
import torch

from lfgp_dmc import observations, task_names
from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.agents.lfgp.config import DiscriminatorReward, PretrainingConfig
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch.benchmarks import profiling
from lfgp_dmc.launch.configs import ALGORITHMS, RunConfig

_ACTION_SIZE = 4
_PAIRS = 2_000  # a task
_ROWS = 20_000  # of the replay
_PRODUCTS = (12, 256, 256)  # the shape of both factors: the critics' own
_ROUNDS = 5  # of updates and products in turns: a shared host's speed wanders
_DTYPES = {"fp32": torch.float32, "bf16": torch.bfloat16}


def measure(
  config: RunConfig, seconds: float, is_profiled: bool = True
) -> Iterator[tuple[str, float]]:
  """Measures updates and matrix products, in fp32 and bf16, 1 and 2 threads.

  Each measurement takes about `seconds`.

  Yields:
    `gflop/<term>` and their sum `gflop_per_update` (see `_gflop_of_update`);
    `updates_per_s_fp32_1thread` and so on, medians over rounds;
    `matmul_gflops_...`; `roofline_fraction_...`: the first times the second
    over the third, median of the rounds' own. If profiled, of one thread:
    `products_gflops_...` and `products_fraction_...`, the same against the
    products that an update really makes, alone; `share_<part>_...` of its time
    (see `profiling`).
  """
  for name, value in _gflop_of_update(config).items():
    yield f"gflop/{name}", value
  operations = operations_of_update(config)
  yield "gflop_per_update", operations / 1e9
  for threads in (1, 2):
    for name, dtype in _DTYPES.items():
      suffix = f"{name}_{threads}thread{'s' if threads > 1 else ''}"
      own = dataclasses.replace(config, bfloat16=name == "bf16")
      agent = make_agent(own, threads=threads)
      rounds = [
        (
          rate(agent.update, seconds / _ROUNDS),
          best_matmul_rate(dtype, threads),
        )
        for _ in range(_ROUNDS)
      ]
      rates, peaks = zip(*rounds, strict=True)
      yield f"updates_per_s_{suffix}", statistics.median(rates)
      yield f"matmul_gflops_{suffix}", statistics.median(peaks) / 1e9
      yield (
        f"roofline_fraction_{suffix}",
        statistics.median(r * operations / p for r, p in rounds),
      )
      if is_profiled and threads == 1:
        products = profiling.product_rate(agent)
        yield f"products_gflops_{suffix}", products / 1e9
        fraction = statistics.median(rates) * operations / products
        yield f"products_fraction_{suffix}", fraction
        for part, share in profiling.time_shares(agent).items():
          yield f"share_{part}_{suffix}", share


def operations_of_update(run: RunConfig) -> float:
  """The sum of the formula's terms."""
  return 1e9 * sum(_gflop_of_update(run).values())


def _gflop_of_update(run: RunConfig) -> dict[str, float]:
  """The terms of one update, in GFLOP, by a fixed formula.

  What the plain equations ask for, 2 operations a multiply-add, whatever an
  implementation does or saves: a backward pass costs twice its forward pass (an
  input gradient alone once), and the gradient penalty, itself differentiated
  twice, six times its forward pass. It takes no account of masked inputs, of
  rows that intentions leave out, or of `reward.every`, so that `few` comes out
  too large, by a factor of 1.9.
  """
  config, tasks = run.agent, len(tasks_of(run))
  assert isinstance(config, LfgpConfig), "of LfGP and its variants"
  observation_size, action_size = observations.OBSERVATION_SIZE, _ACTION_SIZE
  hidden, rows = config.networks.hidden_size, config.batch_size
  shared = observation_size * hidden + hidden * hidden
  if config.networks.layout == layouts.SEPARATE:
    trunk, before = 0, shared  # each head has these layers itself
  else:
    trunk, before = shared, hidden * hidden
  intention = before + hidden * 2 * action_size
  critic = before + action_size * hidden + hidden

  def gflop(multiplications: float, count: int) -> float:
    return 2e-9 * multiplications * count

  terms = {
    "trunk": gflop(trunk, 3 * rows),
    "trunk_next": gflop(trunk, 2 * rows),
    "intentions_next": gflop(intention, tasks * rows),
    "target_critics": gflop(critic, 2 * tasks * rows),
    "critics": gflop(critic, 3 * 2 * tasks * rows),
    "intentions": gflop(intention, 3 * tasks * rows),
    "critics_of_intentions": gflop(critic, 2 * 2 * tasks * rows),
  }
  if isinstance(config.reward, DiscriminatorReward):
    seen = observation_size
    if config.reward.input == "state_action":
      seen += action_size
    discriminator = seen * hidden + hidden * hidden + hidden * tasks
    mixed = tasks * config.reward.batch_size
    terms["discriminator"] = gflop(discriminator, 3 * (rows + mixed))
    terms["gradient_penalty"] = gflop(discriminator, 6 * mixed)
  return terms


def best_matmul_rate(dtype: torch.dtype, threads: int) -> float:
  """Operations a second of batched products as large as the critics'."""
  left, right = (torch.randn(_PRODUCTS).to(dtype) for _ in range(2))
  out = torch.empty(_PRODUCTS, dtype=dtype)
  before = torch.get_num_threads()
  torch.set_num_threads(threads)
  best = profiling.best_time(lambda: torch.bmm(left, right, out=out))
  torch.set_num_threads(before)
  groups, rows, inner = _PRODUCTS
  return 2 * groups * rows * inner * inner / best


def tasks_of(config: RunConfig) -> tuple[str, ...]:
  """What the config's algorithm learns: all of `task_set`, or the main task."""
  if ALGORITHMS[config.algorithm].is_multitask:
    return task_names.task_set(config.main_task)
  return (config.main_task,)


def make_agent(
  config: RunConfig, replay: Replay | None = None, threads: int = 1
):
  """The config's agent; data that lack are made up.

  Without pretraining and the critics' head start. Sets torch's threads.
  """
  tasks = tasks_of(config)
  assert isinstance(config.agent, LfgpConfig), "of LfGP and its variants"
  size = observations.OBSERVATION_SIZE
  torch.set_num_threads(threads)
  if replay is None:
    rows = synthetic.transitions(_ROWS, size, _ACTION_SIZE)
    rewards = np.zeros((_ROWS, len(tasks)), np.float32)  # for SAC-X
    replay = synthetic.replay(rows, rewards, tasks)
  return ALGORITHMS[config.algorithm].build(
    dataclasses.replace(
      config.agent,
      pretraining=PretrainingConfig(),
      critic=dataclasses.replace(config.agent.critic, warmup_updates=0),
    ),
    AgentParts(
      tasks=tasks,
      demonstrations=synthetic.demonstrations(
        tasks, _PAIRS, size, _ACTION_SIZE
      ),
      replay=replay,
      seed=config.seed,
      device="cpu",
      observation_size=size,
      action_size=_ACTION_SIZE,
      bfloat16=config.bfloat16,
      threads=threads,
    ),
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
