"""Demonstrations: one HDF5 file a task, checked before use.

`<dataset>/<task>.hdf5` holds `observation` float32 [N, O], `action` float32
[N, A], `next_observation` float32 [N, O], `episode` int32 [N] (which attempt a
row belongs to, never decreasing), `is_last` bool [N] (the row of success; an
attempt cut by the exact count has none), and the attributes `schema_version`,
`task`, `main_task`, `collection`, `expert`, `seed`, `control_hz`. Your own
attempts become such a file by `write("stack.hdf5", from_attempts(...), {...})`.

With pixels (version 2), an observation is what a robot senses, and `frames`
uint8 [N + E, C, H, W, 3] holds those of each row, and after an episode's last
row those that it led to: each is stored once. Reading checks and unpacks them
into an unnamed file, where any row is at hand without being in memory.
"""

import dataclasses
import os
import pathlib
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from lfgp_dmc.data import demonstration_checks as checks
from lfgp_dmc.data import files, frame_files

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
  frames: np.ndarray | None = None  # uint8 [N + E, C, H, W, 3]

  def __len__(self) -> int:
    """The number of pairs N."""
    return len(self.observation)

  def arrays(self) -> dict[str, np.ndarray]:
    """The five arrays by name."""
    return {k: getattr(self, k) for k in checks.DTYPES}

  def head(self, count: int) -> "Demonstrations":
    """The first `count` pairs."""
    return self._kept(np.arange(len(self)) < count)

  @property
  def attempts(self) -> int:
    """How many whole attempts there are."""
    return int(self.is_last.sum())

  def head_attempts(self, count: int) -> "Demonstrations":
    """The pairs of the first `count` whole attempts."""
    return self._kept(np.isin(self.episode, self.episode[self.is_last][:count]))

  def frame_rows(self) -> np.ndarray:
    """Where in `frames` each row's are, int64 [N]; the next row's follow."""
    begins = np.diff(self.episode, prepend=self.episode[:1]) > 0
    return np.arange(len(self)) + np.cumsum(begins)

  def _kept(self, chosen: np.ndarray) -> "Demonstrations":
    """The pairs of a mask [N], which leaves no gap in an attempt."""
    cut: dict[str, Any] = {k: v[chosen] for k, v in self.arrays().items()}
    frames = self.frames
    if frames is not None:
      rows = self.frame_rows()[chosen]
      places = np.union1d(rows, rows + 1)
      is_head = places[-1] + 1 == len(places)  # which need not be copied
      frames = frames[: len(places)] if is_head else frames[places]
    return dataclasses.replace(self, **cut, frames=frames)


def joined(parts: Sequence[Demonstrations]) -> Demonstrations:
  """One after the other; every attempt keeps a number of its own.

  Attributes are the first's; frames are left out.
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
    DatasetError: there is no attempt, or their widths differ.
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
  shapes = [tuple(np.shape(rows)[1:] for rows in part[:2]) for part in parts]
  for number, shape in enumerate(shapes):
    if shape != shapes[0]:
      raise DatasetError(
        f"attempt {number} has states and actions of {shape}, the first of "
        f"{shapes[0]}"
      )
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
      name = task + SUFFIX
      files.write_bytes(folder / name, _content(final / name, data))
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
  content = _content(path, demonstrations, attributes)
  if path.exists():
    raise FileExistsError(f"{path} exists; nothing was written")
  path.parent.mkdir(parents=True, exist_ok=True)
  files.write_bytes(path, content)


def _content(
  path: pathlib.Path,
  demonstrations: Demonstrations,
  attributes: Mapping[str, Any] | None = None,
) -> bytes:
  """A file's bytes; raises DatasetError that names where it belongs."""
  attributes = {
    "schema_version": checks.SCHEMA_VERSIONS[demonstrations.frames is not None],
    **(demonstrations.attributes if attributes is None else attributes),
  }
  arrays = demonstrations.arrays()
  if demonstrations.frames is not None:
    arrays[checks.FRAMES] = demonstrations.frames
  faults = checks.of_attributes(attributes, None)
  faults += checks.of_arrays(arrays, None, None)
  if faults:
    raise DatasetError(f"{path} not written: {'; '.join(faults)}")
  return frame_files.packed(arrays, attributes, checks.FRAMES)


def read(
  path: files.Path,
  task: str | None = None,
  observation_size: int | None = None,
  action_size: int | None = None,
  frame_shape: tuple[int, ...] | None = None,
) -> Demonstrations:
  """Reads and checks one file; its task, O, A and [C, H, W, 3] if not None.

  Raises:
    DatasetError: it is missing, damaged or breaks the contract; the message
      is one line that names the file and every fault.
    OSError: there is no room to unpack frames.
  """
  path = pathlib.Path(path)
  if not path.is_file():
    raise DatasetError(f"{path}: missing")
  try:
    arrays, attributes = frame_files.read_all(
      path, checks.DTYPES, checks.FRAMES
    )
  except (
    OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError,
    OverflowError, AttributeError,
  ) as error:  # fmt: skip
    if isinstance(error, OSError) and files.is_lack_of_room(error):
      raise  # of the folder for temporary files, where frames are unpacked
    detail = " ".join(str(error).split())
    raise DatasetError(f"{path}: not a readable HDF5 file ({detail})") from None
  faults = checks.of_attributes(attributes, task)
  sizes = observation_size, action_size, frame_shape
  faults += checks.of_arrays(arrays, *sizes)
  if faults:
    raise DatasetError(f"{path}: {'; '.join(faults)}")
  return Demonstrations(**arrays, attributes=attributes)


def read_folder(
  folder: files.Path,
  tasks: Sequence[str],
  observation_size: int | None = None,
  action_size: int | None = None,
  frame_shape: tuple[int, ...] | None = None,
) -> dict[str, Demonstrations]:
  """Reads the files of several tasks, in their order; see `read`.

  Raises:
    DatasetError: one line a faulty file, damaged files before missing ones.
  """
  folder = pathlib.Path(folder)
  if folder.is_file():
    raise DatasetError(f"{folder} is a file; valid: the folder that it is in")
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
      sizes = observation_size, action_size, frame_shape
      found[task] = read(path, task, *sizes)
    except DatasetError as error:
      damaged.append(str(error))
  if damaged or missing:
    raise DatasetError(
      "\n".join([f"the dataset {folder} cannot be used:", *damaged, *missing])
    )
  return found
