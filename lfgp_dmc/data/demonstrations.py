"""Demonstrations: one HDF5 file a task, checked before use.

`<dataset>/<task>.hdf5` holds `observation` float32 [N, O], `action` float32
[N, A], `next_observation` float32 [N, O], `episode` int32 [N] (which attempt a
row belongs to, never decreasing), `is_last` bool [N] (the row of success; an
attempt cut by the exact count has none), and the attributes `schema_version`,
`task`, `main_task`, `collection`, `expert`, `seed`, `control_hz`. Your own
attempts become such a file by `write("stack.hdf5", from_attempts(...), {...})`.
"""

import dataclasses
import io
import os
import pathlib
import tempfile
from collections.abc import Iterable, Mapping, Sequence
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

  def head(self, count: int) -> "Demonstrations":
    """The first `count` pairs."""
    return self._rows(slice(count))

  @property
  def attempts(self) -> int:
    """How many whole attempts there are."""
    return int(self.is_last.sum())

  def head_attempts(self, count: int) -> "Demonstrations":
    """The pairs of the first `count` whole attempts."""
    return self._rows(np.isin(self.episode, self.episode[self.is_last][:count]))

  def _rows(self, kept: slice | np.ndarray) -> "Demonstrations":
    cut: dict[str, Any] = {k: v[kept] for k, v in self.arrays().items()}
    return dataclasses.replace(self, **cut)


def joined(parts: Sequence[Demonstrations]) -> Demonstrations:
  """One after the other; every attempt keeps a number of its own.

  Attributes are the first's.
  """
  counts = [part.episode.max(initial=-1) + 1 for part in parts]
  first = np.cumsum([0, *counts[:-1]], dtype=np.int32)
  numbered = [
    {**part.arrays(), "episode": part.episode + start}
    for part, start in zip(parts, first, strict=True)
  ]
  arrays = {
    name: np.concatenate([part[name] for part in numbered])
    for name in checks.DTYPES
  }
  return Demonstrations(**arrays, attributes=parts[0].attributes)


def from_attempts(
  attempts: Iterable[tuple[np.ndarray, np.ndarray, np.ndarray]],
  attributes: Mapping[str, Any] | None = None,
) -> Demonstrations:
  """Makes pairs of attempts; what was recorded after success is left out.

  Args:
    attempts: of each T + 1 states, [T + 1, O]; T actions, [T, A]; and whether
      each action led to success, bool [T].
    attributes: see `write`.

  Raises:
    DatasetError: there is no attempt.
  """
  parts = []
  for number, (states, actions, succeeded) in enumerate(attempts):
    steps = min(len(actions), int(np.argmax([*succeeded, True])) + 1)
    episode, after = np.full(steps, number), states[1 : steps + 1]
    parts.append(
      (states[:steps], actions[:steps], after, episode, succeeded[:steps])
    )
  if not parts:
    raise DatasetError("there is no attempt")
  arrays = {
    name: np.concatenate(part).astype(dtype)
    for (name, dtype), part in zip(
      checks.DTYPES.items(), zip(*parts, strict=True), strict=True
    )
  }
  return Demonstrations(**arrays, attributes=attributes or {})


def write_folder(path: files.Path, found: Mapping[str, Demonstrations]) -> None:
  """Writes a new dataset folder, a file a task: all of them or nothing.

  Raises:
    DatasetError: as of `write`, or a task's name is no file name.
    FileExistsError: something is already there.
  """
  final = pathlib.Path(path)
  final.parent.mkdir(parents=True, exist_ok=True)
  prefix = f".{final.name}.partial."
  with tempfile.TemporaryDirectory(prefix=prefix, dir=final.parent) as aside:
    folder = pathlib.Path(aside) / final.name
    folder.mkdir()
    for task, data in found.items():
      if pathlib.Path(task).name != task:
        raise DatasetError(f"task is {task!r}; valid: a file's name")
      write(folder / (task + SUFFIX), data)
    if final.exists():
      raise FileExistsError(
        f"{final} exists; datasets are never written into: choose another "
        "folder or move it away"
      )
    os.rename(folder, final)


def write(
  path: files.Path,
  demonstrations: Demonstrations,
  attributes: Mapping[str, Any] | None = None,
) -> None:
  """Writes one task's file: checked first, then whole or not at all.

  Args:
    path: `<dataset>/<task>.hdf5`.
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
  path.parent.mkdir(parents=True, exist_ok=True)
  content = io.BytesIO()  # HDF5 has no OSError for a full disk
  with h5py.File(content, "w") as file:
    for name, array in arrays.items():
      file.create_dataset(name, data=array)
    for name, value in attributes.items():
      file.attrs[name] = value
  files.write_bytes(path, content.getvalue())


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
  except (
    OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError,
    OverflowError, AttributeError,
  ) as error:  # fmt: skip
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


def _read_all(path: pathlib.Path) -> tuple[dict[str, np.ndarray], dict]:
  """Every top-level dataset and every attribute, as NumPy and Python values."""
  arrays = {}
  with h5py.File(path, "r") as file:
    for name in checks.DTYPES:
      if name in file and isinstance(file[name], h5py.Dataset):
        size = file[name].nbytes
        # Compression packs a thousandfold at most.
        if size > 1000 * path.stat().st_size + (1 << 20):
          raise ValueError(f"{name!r} declares {size:,} bytes")
        arrays[name] = np.asarray(file[name][()])
    attributes = {
      name: value.item() if isinstance(value, np.generic) else value
      for name, value in file.attrs.items()
    }
  return arrays, attributes
