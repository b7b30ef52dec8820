"""Speed of evaluation and of collection, with a process on each core."""

import functools
import pathlib
import tempfile
import time
from collections.abc import Iterator

import lfgp_dmc
from lfgp_dmc.acting import collection, evaluation
from lfgp_dmc.acting.attempts import CollectionPlan
from lfgp_dmc.launch import command, policies
from lfgp_dmc.launch.benchmarks import learner
from lfgp_dmc.launch.configs import RunConfig

_PAIRS_AN_EPISODE = 180  # 9,000 a task beside the paper's 50 episodes


def measure(config: RunConfig, episodes: int) -> Iterator[tuple[str, float]]:
  """Evaluates each intention, then collects demonstrations of its task.

  Intentions are those of `config.init_from`, or untrained. Processes that start
  are part of both.

  Yields:
    `processes`; `evaluation_s` of `evaluation_episodes`; `collection_s` of
    `collection_pairs`, by the scripted expert; both of all tasks together.
  """
  tasks, cores = learner.tasks_of(config), command.cores()
  yield "processes", cores
  with tempfile.TemporaryDirectory() as folder:
    if not config.init_from:
      agent = learner.make_agent(config)
      agent.save_policy(pathlib.Path(folder), config.to_dict(), env_step=0)
    start = time.perf_counter()
    rows = evaluation.evaluate(
      functools.partial(config.environment_spec.build, True),
      functools.partial(policies.stored_policy, config.init_from or folder),
      tasks,
      episodes,
      config.evaluation_seed,
      cores,
    )
    yield "evaluation_s", time.perf_counter() - start
  yield "evaluation_episodes", len(rows)
  plan = CollectionPlan(
    functools.partial(lfgp_dmc.load, control_hz=config.control_hz),
    functools.partial(policies.scripted_expert, config.control_hz),
    config.main_task,
    tasks,
    config.seed,
    config.control_hz,
  )
  pairs = _PAIRS_AN_EPISODE * episodes
  start = time.perf_counter()
  collection.collect(plan, "reset", tasks, pairs, cores)
  yield "collection_s", time.perf_counter() - start
  yield "collection_pairs", pairs * len(tasks)
