"""Speed of the whole loop, acting included, against the learner's alone."""

import functools
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import torch

import lfgp_dmc
from lfgp_dmc import observations
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch.benchmarks import learner
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs import loop
from lfgp_dmc.runs.metrics import MetricsLog
from lfgp_dmc.runs.schedule import Progress, TrainSchedule

_ACTION_SIZE = 4
_EPISODE = 360


def measure(
  config: RunConfig, steps: int, seconds: float
) -> Iterator[tuple[str, float]]:
  """Trains for `steps` steps after one episode without updates.

  Torch gets the number of threads with which the learner is faster, not the
  config's. Updates alone are measured for about `seconds`, each time.

  Yields:
    `learner_updates_per_s_1thread`, `..._2threads`: of updates alone, before
    the loop, `..._beside_busy` another process; `loop_threads`;
    `loop_steps_per_s` and `loop_updates_per_s`: of the whole loop;
    `learner_updates_per_s`: of updates alone once more, after it;
    `loop_fraction`: the loop's updates a second over the faster of these.
  """
  replay = Replay(steps + _EPISODE, observations.OBSERVATION_SIZE, _ACTION_SIZE)
  agent = learner.make_agent(config, replay)
  environment = lfgp_dmc.load(config.main_task, seed=config.seed)
  train = functools.partial(_train, config, environment, agent, replay)
  progress = train(_EPISODE, None)
  rates = {}
  for threads in (1, 2):
    torch.set_num_threads(threads)
    name = f"learner_updates_per_s_{threads}thread{'s'[: threads - 1]}"
    rates[threads] = learner.rate(agent.update, seconds)
    yield name, rates[threads]
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:
      try:
        yield f"{name}_beside_busy", learner.rate(agent.update, seconds)
      finally:
        busy.kill()
  threads = max(rates, key=rates.__getitem__)
  torch.set_num_threads(threads)
  yield "loop_threads", threads
  before = progress.update
  start = time.perf_counter()
  progress = train(_EPISODE + steps, progress)
  elapsed = time.perf_counter() - start
  yield "loop_steps_per_s", steps / elapsed
  updates = (progress.update - before) / elapsed
  yield "loop_updates_per_s", updates
  again = learner.rate(agent.update, seconds)
  yield "learner_updates_per_s", again
  yield "loop_fraction", updates / max(again, rates[threads])
  environment.close()


def _train(config, environment, agent, replay, env_steps, progress) -> Progress:
  schedule = TrainSchedule(
    env_steps=env_steps,
    log_every=config.log_every,
    warmup_steps=_EPISODE + 1,
    updates_per_step=config.updates_per_step,
    progress_bar=False,
  )
  with tempfile.TemporaryDirectory() as folder:
    log = MetricsLog(folder)
    progress = loop.EpisodeRounds(
      environment, agent, replay, schedule, log, progress
    ).run()
    log.close()
  return progress
