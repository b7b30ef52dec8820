"""What many tests share: a folder of their own, demonstrations, a toy agent."""

import contextlib
import pathlib
import resource
import tempfile
from collections.abc import Iterator

import numpy as np
from absl.testing import absltest, parameterized

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
