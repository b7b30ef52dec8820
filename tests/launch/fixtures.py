"""Small datasets and configs for the tests of launch."""

import contextlib
import dataclasses
import os
import pathlib
import signal
import subprocess
import sys
from collections.abc import Iterator
from unittest import mock

import numpy as np

from lfgp_dmc import toy
from lfgp_dmc.agents import synthetic
from lfgp_dmc.data import demonstrations
from lfgp_dmc.launch import configs, training
from lfgp_dmc.runs import run
from tests import fixtures
from tests.launch import forked

POINT = "lfgp_dmc.toy:PointEnvironment"
_LAUNCH = pathlib.Path(configs.__file__).resolve().parents[1]
_DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM")


def call(
  line: str, folder: os.PathLike | str, *, fresh: bool = False
) -> subprocess.CompletedProcess:
  """Runs a command, such as `plot.py --runs=a`, without a display.

  With `fresh` as users start it, else faster: by `forked`.
  """
  script, *arguments = line.split()
  command = [str(_LAUNCH / script), *arguments]
  variables = {k: v for k, v in os.environ.items() if k not in _DISPLAYS}
  if not fresh:
    return forked.run(command, str(folder), variables)
  return subprocess.run(
    [sys.executable, *command],
    cwd=folder,
    env=variables,
    capture_output=True,
    text=True,
    check=False,
  )


def write_dataset(
  folder: pathlib.Path,
  tasks=toy.TASKS,
  observation_size: int = 2,
  action_size: int = 2,
  pairs: int = 60,
) -> pathlib.Path:
  """Writes made-up demonstrations; by default for the toy environment."""
  folder.mkdir(parents=True)
  made = synthetic.demonstrations(
    tasks, pairs, observation_size, action_size, attempt=20
  )
  for task, data in made.items():
    arrays = {f.name: getattr(data, f.name) for f in dataclasses.fields(data)}
    arrays["action"] = np.clip(arrays["action"], -1, 1)
    demonstrations.write(
      folder / f"{task}.hdf5",
      demonstrations.Demonstrations(**arrays),
      {
        "task": task,
        "main_task": tasks[0],
        "collection": "reset",
        "expert": "synthetic",
        "seed": 0,
        "control_hz": 20,
      },
    )
  return folder


def load_cartpole(seed: int = 0):
  """A task of the control suite, half a second long; it tells no success."""
  from dm_control import suite

  return suite.load(
    "cartpole", "swingup", task_kwargs={"random": seed, "time_limit": 0.5}
  )


def small_config(dataset: pathlib.Path, **changes) -> configs.RunConfig:
  """A run of the toy environment that takes a second or two."""
  kinds = {
    name: value
    for name, value in changes.items()
    if name.endswith(configs.KIND)
  }
  config = configs.make_config(changes.get("algorithm", "lfgp"), kinds=kinds)
  small = {
    "agent.batch_size": 8,
    "agent.networks.hidden_size": 16,
    "agent.reward.batch_size": 8,
    "agent.scheduler.xi": 5,
    "checkpoint_every": 40,
    "demonstrations": str(dataset),
    "deterministic": True,
    "device": "cpu",
    "env_steps": 200,
    "episode_steps": 20 if changes.get("environment", POINT) else 0,
    "environment": POINT,
    "evaluate_every": 100,
    "evaluation_episodes": 2,
    "evaluation_workers": 1,
    "log_every": 20,
    "main_task": "right",
    "random_steps": 20,
    "replay_capacity": 200,
    "warm_up": 20,
  }
  known = dict(configs.flattened(config.to_dict()))
  small = {name: value for name, value in small.items() if name in known}
  config.update_from_flattened_dict({**small, **changes})
  return configs.from_dict(config.to_dict())


def numbers(run: pathlib.Path) -> list[list[dict[str, str]]]:
  """The rows of a run's metrics and of its evaluations."""
  return [
    fixtures.rows(run / name) for name in ("metrics.csv", "evaluation.csv")
  ]


@contextlib.contextmanager
def stopped_after(checkpoints: int) -> Iterator[None]:
  """Runs within get SIGTERM after so many checkpoints."""
  real, calls = run.Run._checkpoint, []

  def checkpoint_and_stop(self, progress):
    real(self, progress)
    calls.append(progress.env_step)
    if len(calls) == checkpoints:
      signal.raise_signal(signal.SIGTERM)

  with mock.patch.object(run.Run, "_checkpoint", checkpoint_and_stop):
    yield


class RunTest(fixtures.FolderTest):
  """Trains tiny runs of the toy environment in a folder of their own."""

  def setUp(self):
    super().setUp()
    self.dataset = write_dataset(self.folder / "data")

  def config(self, **changes) -> configs.RunConfig:
    return small_config(self.dataset, **changes)

  def train(self, config, name="a", resume=False):
    """The run's folder, and its progress."""
    path = self.folder / "runs" / name
    return path, training.train(config, path, resume, progress_bar=False)

  def check_resume(self, config, checkpoints=1):
    """A run that is stopped and resumed equals one that never was."""
    whole, progress = self.train(config, "whole")
    with stopped_after(checkpoints):
      path, stopped = self.train(config, "stopped")
    self.assertFalse(stopped.is_complete)
    # What a kill after a later row would leave, too.
    with open(path / "metrics.csv", "a", encoding="utf-8") as file:
      file.write("9999,9999")
    _, resumed = self.train(config, "stopped", resume=True)
    self.assertEqual(resumed.update, progress.update)
    self.assertEqual(numbers(path), numbers(whole))
    policies = [(p / "policy.safetensors").read_bytes() for p in (path, whole)]
    self.assertEqual(*policies)
