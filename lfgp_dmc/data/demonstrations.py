"""Demonstrations: one HDF5 file a task, checked before use.

`<dataset>/<task>.hdf5` holds `observation` float32 [N, O], `action` float32
[N, A], `next_observation` float32 [N, O], `episode` int32 [N] (which attempt a
row belongs to, never decreasing), `is_last` bool [N] (the row of success; an
attempt cut by the exact count has none), and the attributes `schema_version`,
`task`, `main_task`, `collection`, `expert`, `seed`, `control_hz`. Your own
arrays become such a file by `write("stack.hdf5", Demonstrations(...), {...})`.
"""

import dataclasses
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import h5py
import numpy as np

from lfgp_dmc.data import demonstration_checks as checks
from lfgp_dmc.data import files

SUFFIX = ".hdf5"


class DatasetError(ValueError):
  """Demonstrations that cannot be used; one line a file in the message."""


@dataclasses.dataclass(frozen=True)
class Demonstrations:
  """N pairs of one task, in the order of demonstration."""

  observation: np.ndarray  # float32 [N, O]
  action: np.ndarray  # float32 [N, A], in [-1, 1]
  next_observation: np.ndarray  # float32 [N, O]
  episode: np.ndarray  # int32 [N]
  is_last: np.ndarray  # bool [N]
  attributes: Mapping[str, Any] = dataclasses.field(default_factory=dict)

  def __len__(self) -> int:
    """The number of pairs N."""
    return len(self.observation)

  def arrays(self) -> dict[str, np.ndarray]:
    """The five arrays by name."""
    return {k: getattr(self, k) for k in checks.DTYPES}

  def head(self, pairs: int) -> "Demonstrations":
    """The first `pairs` pairs."""
    cut = {name: array[:pairs] for name, array in self.arrays().items()}
    return Demonstrations(**cut, attributes=self.attributes)

  @property
  def attempts(self) -> int:
    """How many whole attempts there are."""
    return int(self.is_last.sum())

  def first_attempts(self, attempts: int) -> "Demonstrations":
    """The pairs of the first `attempts` whole attempts."""
    kept = np.isin(self.episode, self.episode[self.is_last][:attempts])
    cut = {name: array[kept] for name, array in self.arrays().items()}
    return Demonstrations(**cut, attributes=self.attributes)


def create_folder(path: files.Path) -> pathlib.Path:
  """Makes a new dataset folder; an existing one is never written into.

  Raises:
    FileExistsError: something is already there.
  """
  folder = pathlib.Path(path)
  try:
    folder.mkdir(parents=True)
  except FileExistsError:
    raise FileExistsError(
      f"{folder} exists; datasets are never written into: choose another "
      "--output or move it away"
    ) from None
  return folder


def write(
  path: files.Path,
  demonstrations: Demonstrations,
  attributes: Mapping[str, Any] | None = None,
) -> None:
  """Writes one task's file: checked first, then whole or not at all.

  Args:
    path: `<dataset>/<task>.hdf5`, in a folder that exists.
    demonstrations: of the task.
    attributes: `task`, `main_task`, `collection`, `expert`, `seed`,
      `control_hz`; None takes the demonstrations' own. `schema_version` is
      added.

  Raises:
    DatasetError: the data or the attributes break the contract.
    FileExistsError: the file exists.
  """
  path = pathlib.Path(path)
  attributes = {
    "schema_version": checks.SCHEMA_VERSION,
    **(demonstrations.attributes if attributes is None else attributes),
  }
  arrays = demonstrations.arrays()
  faults = checks.of_attributes(attributes, None)
  faults += checks.of_arrays(arrays, None, None)
  if faults:
    raise DatasetError(f"{path} not written: {'; '.join(faults)}")
  if path.exists():
    raise FileExistsError(f"{path} exists; nothing was written")
  with files.replacing(path) as aside, h5py.File(aside, "w") as file:
    for name, array in arrays.items():
      file.create_dataset(name, data=array)
    for name, value in attributes.items():
      file.attrs[name] = value


def read(
  path: files.Path,
  task: str | None = None,
  observation_size: int | None = None,
  action_size: int | None = None,
) -> Demonstrations:
  """Reads and checks one file, whose task, O and A may be any if None.

  Raises:
    DatasetError: it is missing, damaged or breaks the contract; the message
      is one line that names the file and every fault.
  """
  path = pathlib.Path(path)
  if not path.is_file():
    raise DatasetError(f"{path}: missing")
  try:
    arrays, attributes = _read_all(path)
  except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
    detail = " ".join(str(error).split())
    raise DatasetError(f"{path}: not a readable HDF5 file ({detail})") from None
  faults = checks.of_attributes(attributes, task)
  faults += checks.of_arrays(arrays, observation_size, action_size)
  if faults:
    raise DatasetError(f"{path}: {'; '.join(faults)}")
  known = {name: arrays[name] for name in checks.DTYPES}
  return Demonstrations(**known, attributes=attributes)


def read_folder(
  folder: files.Path,
  tasks: Sequence[str],
  observation_size: int | None = None,
  action_size: int | None = None,
) -> dict[str, Demonstrations]:
  """Reads the files of several tasks, in their order; see `read`.

  Raises:
    DatasetError: one line a faulty file, damaged files before missing ones.
  """
  folder = pathlib.Path(folder)
  if not folder.is_dir():
    raise DatasetError(
      f"no dataset folder {folder}; it needs: "
      f"{', '.join(task + SUFFIX for task in tasks)}"
    )
  found, damaged, missing = {}, [], []
  for task in tasks:
    path = folder / (task + SUFFIX)
    if not path.exists():
      missing.append(f"{path}: missing")
      continue
    try:
      found[task] = read(path, task, observation_size, action_size)
    except DatasetError as error:
      damaged.append(str(error))
  if damaged or missing:
    raise DatasetError(
      "\n".join([f"the dataset {folder} cannot be used:", *damaged, *missing])
    )
  return found


def summary_table(demonstrations: Mapping[str, Demonstrations]) -> str:
  """A plain-text table of what a dataset holds, one row a task.

  Columns: pairs, episodes, mean and longest episode in steps, share of rows
  that are an episode's success, mean |a|, share of action values beyond 0.95,
  and the share of rows that have the commonest gripper value (last action).
  """
  rows = [
    f"{'task':<16}{'pairs':>8}{'episodes':>10}{'mean len':>10}{'longest':>9}"
    f"{'is_last':>9}{'mean |a|':>10}{'> 0.95':>8}{'gripper':>9}"
  ]
  for task, data in demonstrations.items():
    lengths = np.unique(data.episode, return_counts=True)[1]
    gripper = np.unique(data.action[:, -1], return_counts=True)[1]
    size = np.abs(data.action)
    rows.append(
      f"{task:<16}{len(data):>8}{len(lengths):>10}{lengths.mean():>10.1f}"
      f"{lengths.max():>9}{data.is_last.mean():>9.2%}{size.mean():>10.3f}"
      f"{(size > 0.95).mean():>8.1%}{gripper.max() / len(data):>9.2%}"
    )
  return "\n".join(rows)


def _read_all(path: os.PathLike[str]) -> tuple[dict[str, np.ndarray], dict]:
  """Every top-level dataset and every attribute, as NumPy and Python values."""
  arrays = {}
  with h5py.File(path, "r") as file:
    for name in checks.DTYPES:
      if name in file and isinstance(file[name], h5py.Dataset):
        arrays[name] = file[name][()]
    attributes = {
      name: value.item() if isinstance(value, np.generic) else value
      for name, value in file.attrs.items()
    }
  return arrays, attributes
