"""Small configs, agents and learners on made-up data.

Settings go by dotted names: `make_agent(**{"scheduler.xi": 5})`.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch

from lfgp_dmc import toy
from lfgp_dmc.acting import environments, evaluation
from lfgp_dmc.agents import bc, lfgp, synthetic
from lfgp_dmc.agents.batches import Batch
from lfgp_dmc.agents.bc import BcConfig
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp import LfgpConfig
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.data.demonstrations import Demonstrations
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs import loop, metrics, pytree
from lfgp_dmc.runs.schedule import TrainSchedule

TASKS = ("stack", "reach", "lift")
OBS, A, B = 6, 2, 32


def nested(fields: Mapping[str, Any]) -> dict[str, Any]:
  """{"a.b": 1} -> {"a": {"b": 1}}."""
  tree: dict[str, Any] = {}
  for name, value in fields.items():
    group, _, field = name.rpartition(".")
    (tree.setdefault(group, {}) if group else tree)[field] = value
  return tree


def config(**fields: Any) -> LfgpConfig:
  """A small LfGP."""
  small = {"batch_size": B, "networks.hidden_size": 16}
  fields.setdefault("reward.kind", "discriminator")
  fields.setdefault("scheduler.kind", "q_table")
  if fields["reward.kind"] == "discriminator":
    small["reward.batch_size"] = B
  return LfgpConfig(**nested({**small, **fields}))


def demonstrations(
  tasks: Sequence[str] = TASKS,
  observations: int = OBS,
  actions: int = A,
  pairs: int = 100,
  attempt: int = 20,
):
  """Of each task, by `synthetic.demonstrations`."""
  sizes = (pairs, observations, actions)
  return synthetic.demonstrations(tasks, *sizes, attempt=attempt)


def make_agent(
  tasks: Sequence[str] = TASKS,
  seed: int = 0,
  *,
  shown=None,
  replay=None,
  sizes: tuple[int, int] = (OBS, A),
  bfloat16: bool = False,
  threads: int = 1,
  **fields: Any,
):
  """A small LfGP agent on made-up data; `fields`: of `config`."""
  if shown is None:
    shown = demonstrations(tasks, *sizes)
  if replay is None:
    replay = synthetic.replay(synthetic.transitions(200, *sizes))
  made = parts(tasks, shown, replay, seed, sizes, bfloat16=bfloat16,
               threads=threads)  # fmt: skip
  return lfgp.build(config(**fields), made)


def parts(
  tasks: Sequence[str],
  shown: Mapping[str, Demonstrations],
  replay: Replay | None = None,
  seed: int = 0,
  sizes: tuple[int, int] = (OBS, A),
  **options: Any,
) -> AgentParts:
  """What an agent is built from, on the CPU."""
  return AgentParts(
    tasks=tuple(tasks),
    demonstrations=shown,
    replay=replay,
    seed=seed,
    device="cpu",
    observation_size=sizes[0],
    action_size=sizes[1],
    **options,
  )


def make_learner(*args: Any, **fields: Any):
  """That of `make_agent`."""
  return make_agent(*args, **fields).learner


def make_bc(tasks: Sequence[str] = TASKS, seed: int = 0, **fields: Any):
  """A small BC agent on made-up data."""
  small = {
    "batch_size": 16,
    "learning_rate": 3e-3,
    "networks.hidden_size": 32,
    "networks.layout": "separate" if len(tasks) == 1 else "shared_trunk",
  }
  bfloat16 = fields.pop("bfloat16", False)
  settings = BcConfig(**nested({**small, **fields}))
  made = parts(tasks, demonstrations(tasks), seed=seed, bfloat16=bfloat16)
  return bc.build(settings, made)


def pool() -> ExpertPool:
  """The experts of `TASKS`."""
  return ExpertPool(demonstrations(), TASKS, Standardiser(OBS))


def batch(rows: int = B, seed: int = 0, sizes=(OBS, A)) -> Batch:
  """Transitions."""
  made = synthetic.transitions(rows, *sizes, seed)
  return Batch(*map(torch.from_numpy, made))


def train(agent, updates: int) -> dict[str, float]:
  """Makes so many updates; their metrics."""
  for _ in range(updates):
    agent.update()
  return agent.metrics()


def chosen(agent, observations: np.ndarray) -> list[int]:
  """Acts through an episode: the indices of the scheduled tasks."""
  agent.begin_episode()
  tasks = []
  for row in observations:
    agent.act(row)
    tasks.append(agent.tasks.index(agent._task))
  return tasks


def among(rows, *arrays: np.ndarray) -> list[bool]:
  """Which rows are rows of one of the arrays."""
  known = {row.tobytes() for array in arrays for row in array}
  return [row.tobytes() in known for row in np.asarray(rows)]


def states(module: torch.nn.Module) -> dict[str, torch.Tensor]:
  """A copy of all parameters and buffers."""
  return {name: value.clone() for name, value in module.state_dict().items()}


def moved(before: Mapping[str, torch.Tensor], module: torch.nn.Module) -> set:
  """The names of what has changed since."""
  now = module.state_dict()
  return {
    name for name, old in before.items() if not torch.equal(old, now[name])
  }


def reloaded(state: Mapping[str, Any]) -> dict[str, Any]:
  """A state as a checkpoint gives it back."""
  arrays, tree = pytree.pack(state)
  return pytree.unpack(arrays, json.loads(json.dumps(tree)))


def assert_same_policy(one, other) -> None:
  """Both agents act alike, to the bit."""
  for name, array in one.policy.arrays().items():
    np.testing.assert_array_equal(array, other.policy.arrays()[name])


def make_toy_agent(
  seed: int, rows: int, shown=None, reward_tasks: Sequence[str] = (), **fields
):
  """An agent for the toy world, and its empty replay."""
  sizes = environments.widths(toy.PointEnvironment())
  replay = Replay(rows, *sizes, reward_tasks=reward_tasks)
  fields = {"networks.hidden_size": 32, "replay": replay, **fields}
  agent = make_agent(toy.TASKS, seed, shown=shown or {}, sizes=sizes, **fields)
  return agent, replay


def train_on_toy(agent, replay, env_steps: int, folder: str) -> None:
  """Updates once a step, from 100 steps on."""
  schedule = TrainSchedule(
    env_steps=env_steps, warmup_steps=100, progress_bar=False
  )
  log = metrics.MetricsLog(folder)
  environment = toy.PointEnvironment()
  loop.EpisodeRounds(environment, agent, replay, schedule, log).run()


def evaluate_on_toy(agent, episodes: int):
  """The rows of an evaluation of both tasks."""
  return evaluation.evaluate(
    toy.PointEnvironment,
    lambda: agent.policy,
    toy.TASKS,
    episodes=episodes,
    seed=0,
    progress=False,
  )
