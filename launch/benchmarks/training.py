"""Speed of the whole loop, acting included, against the learner's alone."""

import collections
import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import torch

from lfgp_dmc import observations
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch.benchmarks import learner
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs import loop
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.schedule import Progress, TrainSchedule

_ACTION_SIZE = 4
_ROUNDS = 3  # of all measurements in turns: a shared host's speed wanders


def measure(
  config: RunConfig, steps: int, seconds: float
) -> Iterator[tuple[str, float]]:
  """Trains on one thread and on two, alone and beside a busy process.

  Each for `steps` steps, and for about `seconds` without acting.

  Yields:
    Medians over rounds: `learner_updates_per_s_1thread` and `..._2threads`, of
    updates alone; `loop_updates_per_s_...`, of the whole loop; their ratio
    `loop_fraction_...`; `loop_updates_per_s_..._beside_busy`;
    `second_thread_gain` and `..._beside_busy`, the loop's ratio of two to one.
  """
  runs = {threads: _Run(config, steps, threads) for threads in (1, 2)}
  found = collections.defaultdict(list)
  for _ in range(_ROUNDS):
    row = {}
    for threads, run in runs.items():
      torch.set_num_threads(run.threads_of_torch)
      suffix = f"{threads}thread{'s'[: threads - 1]}"
      alone = learner.rate(run.agent.update, seconds / _ROUNDS)
      row[f"learner_updates_per_s_{suffix}"] = alone
      whole = row[f"loop_updates_per_s_{suffix}"] = run.rate(steps // _ROUNDS)
      row[f"loop_fraction_{suffix}"] = whole / alone
      with _busy_process():
        whole = run.rate(steps // _ROUNDS)
      row[f"loop_updates_per_s_{suffix}_beside_busy"] = whole
    for state in ("", "_beside_busy"):
      one, two = (
        row[f"loop_updates_per_s_{suffix}{state}"]
        for suffix in ("1thread", "2threads")
      )
      row[f"second_thread_gain{state}"] = two / one
    for name, value in row.items():
      found[name].append(value)
  for name, values in found.items():
    yield name, statistics.median(values)


class _Run:
  """A run that goes on each time."""

  def __init__(self, config: RunConfig, steps: int, threads: int):
    """Fills the replay with what the first update needs."""
    self._config, self._progress = config, Progress()
    first = config.agent.batch_size
    self._replay = Replay(
      4 * steps + first, observations.OBSERVATION_SIZE, _ACTION_SIZE
    )
    self.agent = learner.make_agent(config, self._replay, threads)
    self.threads_of_torch = torch.get_num_threads()  # a second may share them
    self._environment = config.environment_spec.build(seed=config.seed)
    self._train(first, warmup_steps=first + 1)

  def rate(self, steps: int) -> float:
    """Updates a second over some more steps."""
    before, start = self._progress.update, time.perf_counter()
    self._train(steps)
    return (self._progress.update - before) / (time.perf_counter() - start)

  def _train(self, steps: int, warmup_steps: int = 1) -> None:
    self._progress.is_complete = False
    schedule = TrainSchedule(
      env_steps=self._progress.env_step + max(1, steps),
      log_every=self._config.log_every,
      warmup_steps=warmup_steps,
      updates_per_step=self._config.updates_per_step,
      progress_bar=False,
    )
    with tempfile.TemporaryDirectory() as folder:
      log = MetricsLog(folder)
      self._progress = loop.EpisodeRounds(
        self._environment, self.agent, self._replay, schedule, log,
        self._progress,
      ).run()  # fmt: skip
      log.close()


@contextlib.contextmanager
def _busy_process() -> Iterator[None]:
  with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:
    try:
      yield
    finally:
      busy.kill()
