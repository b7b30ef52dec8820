"""The authors' published states of success as demonstrations of one row each.

`<folder>/<task>.npz` holds `observation` [N, 59], `action` [N, 4] and
`next_observation` [N, 59]: the last transition of N episodes in their PyBullet
world. Three things differ from our layout and are converted: quaternions are
x y z w; blocks start upside down, which a cube does not show; floats 47:53
point to the zones' centres, 1 cm below p_s.

Such rows show success but no way to it: they serve examples-only learning.
"""

import pathlib
import zipfile
import zlib
from collections.abc import Sequence

import numpy as np

from lfgp_dmc.data import files
from lfgp_dmc.data.demonstrations import DatasetError, Demonstrations
from lfgp_dmc.observations import OBSERVATION_SIZE
from lfgp_dmc.tasks.rotations import reduce_rotation

SUFFIX = ".npz"
_ROTATIONS = (slice(15, 19), slice(22, 26))  # of blue, of green
_HEIGHTS_TO_SLOTS = [49, 52]
_ZONE_TO_SLOT = 0.01  # m, from the zone's centre to an inserted block's
_ARRAYS = ("observation", "action", "next_observation")


def is_folder_of_examples(folder: files.Path) -> bool:
  """Whether a dataset folder holds such files."""
  return bool(files.own(folder, SUFFIX))


def read_folder(
  folder: files.Path, tasks: Sequence[str]
) -> dict[str, Demonstrations]:
  """Reads and converts the files of the tasks; each row ends an episode.

  Raises:
    DatasetError: one line a faulty or missing file.
  """
  found, faults = {}, []
  for task in tasks:
    path = pathlib.Path(folder) / (task + SUFFIX)
    try:
      found[task] = _read(path)
    except FileNotFoundError:
      faults.append(f"{path}: missing")
    except (
      OSError, ValueError, KeyError, TypeError, AttributeError, EOFError,
      MemoryError, zipfile.BadZipFile, zlib.error,
    ) as error:  # fmt: skip
      faults.append(f"{path}: {' '.join(str(error).split())}")
  if faults:
    raise DatasetError(
      "\n".join([f"the examples {folder} cannot be used:", *faults])
    )
  return found


def _convert(observation: np.ndarray) -> np.ndarray:
  """Published observations, float [N, 59], in our layout, float32 [N, 59]."""
  ours = np.array(observation, np.float32)
  for part in _ROTATIONS:
    quaternions = np.roll(observation[:, part], 1, axis=1)  # w first
    ours[:, part] = reduce_rotation(quaternions)
  ours[:, _HEIGHTS_TO_SLOTS] += _ZONE_TO_SLOT
  return ours


def _read(path: pathlib.Path) -> Demonstrations:
  with np.load(path, allow_pickle=False) as stored:
    observation, action, following = (stored[name] for name in _ARRAYS)
  rows = len(action)
  shapes = (observation.shape, action.shape, following.shape)
  wide = (rows, OBSERVATION_SIZE)
  if not rows or shapes != (wide, (rows, 4), wide):
    raise ValueError(f"arrays of shapes {shapes}; valid: [N, 59], [N, 4]")
  if not all(np.isfinite(a).all() for a in (observation, action, following)):
    raise ValueError("NaN or infinity among the numbers")
  return Demonstrations(
    _convert(observation),
    np.clip(action, -1, 1).astype(np.float32),
    _convert(following),
    np.arange(rows, dtype=np.int32),
    np.ones(rows, np.bool_),
    {"task": path.stem, "expert": "published examples"},
  )
