"""Speed of the whole loop: environment, replay, updates."""

import tempfile
import time
from collections.abc import Iterator

import torch

import lfgp_dmc
from launch.benchmarks import learner
from launch.configs import RunConfig
from lfgp_dmc import loop, observations
from lfgp_dmc.metrics import MetricsLog
from lfgp_dmc.replay import Replay

_ACTION_SIZE = 4
_EPISODE = 360


def measure(
  config: RunConfig, steps: int, seconds: float
) -> Iterator[tuple[str, float]]:
  """Trains for `steps` steps after one episode without updates.

  Args:
    config: of the run; demonstrations are made up.
    steps: environment steps with updates.
    seconds: about how long the updates alone are measured.

  Yields:
    `loop_steps_per_s`: of the whole loop; `learner_updates_per_s`: of updates
    alone, on the same replay.
  """
  torch.set_num_threads(config.threads or torch.get_num_threads())
  environment = lfgp_dmc.load(config.main_task, seed=config.seed)
  replay = Replay(steps + _EPISODE, observations.OBSERVATION_SIZE, _ACTION_SIZE)
  agent = learner.make_agent(config, replay)

  def train(env_steps: int, progress: loop.Progress | None) -> loop.Progress:
    schedule = loop.TrainSchedule(
      env_steps=env_steps,
      log_every=config.log_every,
      warmup_steps=_EPISODE,
      updates_per_step=config.agent.updates_per_step,
      progress_bar=False,
    )
    with tempfile.TemporaryDirectory() as folder:
      log = MetricsLog(folder)
      progress = loop.train(
        environment, agent, replay, schedule, log, progress=progress
      )
      log.close()
    return progress

  progress = train(_EPISODE, None)
  start = time.perf_counter()
  train(_EPISODE + steps, progress)
  yield "loop_steps_per_s", steps / (time.perf_counter() - start)
  yield "learner_updates_per_s", learner.rate(agent.update, seconds)
  environment.close()
