"""What many tests share: a folder of their own, demonstrations, a toy agent."""

import contextlib
import dataclasses
import pathlib
import resource
import tempfile
from collections.abc import Iterator

import numpy as np
from absl.testing import absltest, parameterized
from dm_env import specs

from lfgp_dmc import toy
from lfgp_dmc.data import csv_files
from lfgp_dmc.data.demonstrations import Demonstrations

ATTRIBUTES = {
  "task": "reach",
  "main_task": "stack",
  "collection": "reset",
  "expert": "scripted",
  "seed": 0,
  "control_hz": 20,
}


class FolderTest(parameterized.TestCase):
  """A test with an empty folder."""

  def setUp(self):
    super().setUp()
    self.folder = pathlib.Path(self.create_tempdir().full_path)


def class_folder(test: type[absltest.TestCase]) -> pathlib.Path:
  """An empty folder for all tests of a class."""
  temporary = tempfile.TemporaryDirectory()
  test.addClassCleanup(temporary.cleanup)
  return pathlib.Path(temporary.name)


def demonstrations(*lengths: int) -> Demonstrations:
  """Attempts of these lengths, 5 and 2 floats; the last one is cut."""
  random, total = np.random.default_rng(0), sum(lengths)
  episode = np.repeat(np.arange(len(lengths)), lengths).astype(np.int32)
  states = random.normal(size=(total + 1, 5)).astype(np.float32)
  is_last = np.append(np.diff(episode) > 0, False)
  observation, after = states[:-1].copy(), states[1:].copy()
  after[is_last] += 1
  return Demonstrations(
    observation,
    random.uniform(-1, 1, (total, 2)).astype(np.float32),
    after,
    episode,
    is_last,
    ATTRIBUTES,
  )


def with_frames(data: Demonstrations, size: int = 20) -> Demonstrations:
  """Noise to be seen beside the pairs, by two cameras."""
  rows = len(data) + len(np.unique(data.episode))
  random = np.random.default_rng(1)
  frames = random.integers(256, size=(rows, 2, size, size, 3), dtype=np.uint8)
  return dataclasses.replace(data, frames=frames)


class SeenPoint(toy.PointEnvironment):
  """The toy world by camera: where the point is can only be seen."""

  def observation_spec(self):
    _, *tasks = super().observation_spec().items()
    return {
      "clock": specs.Array((1,), np.float32),
      **dict(tasks),
      "camera/above": specs.Array((32, 32, 3), np.uint8),
    }

  def _observe(self):
    position, *tasks = super()._observe().items()
    frame = np.zeros((32, 32, 3), np.uint8)
    column, row = ((position[1] + 1) * 14).astype(int)
    frame[row : row + 3, column : column + 3] = 255
    clock = np.array([self._steps / 20], np.float32)
    return {"clock": clock, **dict(tasks), "camera/above": frame}

  def clear_success(self):
    self._done = dict.fromkeys(toy.TASKS, False)


@contextlib.contextmanager
def full_disk(size: int = 20_000) -> Iterator[None]:
  """No file can grow beyond `size` bytes, whoever writes it."""
  limits = resource.getrlimit(resource.RLIMIT_FSIZE)
  resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
  try:
    yield
  finally:
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)


_RATES = ("wall_s", "steps_per_s", "updates_per_s")


def rows(path: pathlib.Path) -> list[dict[str, str]]:
  """A run's CSV file without what depends on the clock."""
  _, found = csv_files.read(path)
  return [{k: v for k, v in row.items() if k not in _RATES} for row in found]


class ToyAgent:
  """An acting agent of the toy world that acts at random and learns nothing."""

  tasks = toy.TASKS

  def __init__(self):
    self.random = np.random.default_rng(3)
    self.updates = 0

  def prepare(self, progress_bar):
    pass

  def begin_episode(self):
    pass

  def act(self, observation):
    return self.random.uniform(-0.5, 0.5, 2).astype(np.float32)

  def end_episode(self, episode):
    pass

  def update(self):
    self.updates += 1

  def metrics(self):
    return {"loss/critic": float(self.updates)}

  def save_policy(self, folder, config, env_step):
    pass

  def state_dict(self):
    return {}

  def load_state_dict(self, state):
    pass
