"""Demonstrations to and from Minari; needs the extra `minari`.

Minari keeps whole trajectories: T + 1 observations of T actions, rewards and
ends. Demonstrations have no rewards: they are 0 there. A trajectory that ends
in success is `terminated`, any other `truncated`, and is read back so. Any
local dataset of flat float observations can be read (`MINARI_DATASETS_PATH`).
"""

import json
import pathlib
import shutil
from collections.abc import Mapping
from typing import Any

import gymnasium
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer
from minari.dataset.minari_dataset import parse_dataset_id
from minari.namespace import validate_namespace
from minari.storage import get_dataset_path

from lfgp_dmc.data.demonstration_summary import jumps
from lfgp_dmc.data.demonstrations import Demonstrations, from_attempts

_KEY = "lfgp_dmc"  # of our attributes in Minari's metadata


def to_minari(found: Mapping[str, Demonstrations]) -> None:
  """Stores demonstrations as local Minari datasets: all of them or nothing.

  The keys are Minari's names, such as "lfgp_dmc/stack_reset/reach-v0".

  Raises:
    ValueError: a name is taken or no name of Minari, an episode's rows do not
      follow from one another, or there are frames; the message names the
      dataset.
  """
  for dataset_id, data in found.items():
    _check(data, dataset_id)
    if data.frames is not None:
      raise ValueError(f"{dataset_id}: valid: demonstrations without frames")
  made: list[pathlib.Path] = []
  try:
    for dataset_id, data in found.items():
      path = get_dataset_path(dataset_id)
      made += [new for new in (path, *path.parents) if not new.exists()]
      _create(data, dataset_id)
  except BaseException:
    for folder in made:
      shutil.rmtree(folder, ignore_errors=True)
    raise


def _check(data: Demonstrations, dataset_id: str) -> None:
  """Raises ValueError if Minari could not store or list the dataset."""
  try:
    namespace, *_ = parse_dataset_id(dataset_id)
    if namespace is not None:
      validate_namespace(namespace)
  except (TypeError, ValueError):  # the first without a version
    raise ValueError(
      f"{dataset_id!r} is no name of Minari; valid: NAMESPACE/NAME-v0 of "
      "letters, digits, - and _"
    ) from None
  path = get_dataset_path(dataset_id)
  # A dataset is a folder with `data` in it; so may be what holds Minari's own.
  root = get_dataset_path("")
  around = [p for p in path.parents if root in p.parents]
  for place in (path, *(p for p in around if (p / "data").exists())):
    if place.exists():
      raise ValueError(
        f"the Minari dataset {place} exists; choose another, or delete it"
      )
  if rows := jumps(data):
    raise ValueError(
      f"{dataset_id}: row {rows[0]} does not start where the row before ended; "
      "Minari keeps whole trajectories"
    )


def _create(data: Demonstrations, dataset_id: str) -> None:
  dataset = minari.create_dataset_from_buffers(
    dataset_id,
    [_buffer(data, rows) for rows in _episodes(data)],
    observation_space=_box(np.inf, data.observation.shape[1]),
    action_space=_box(1.0, data.action.shape[1]),
    algorithm_name=str(data.attributes.get("expert", "unknown")),
    description="Demonstrations of LfGP-DMC.",
  )
  dataset.storage.update_metadata({_KEY: json.dumps(dict(data.attributes))})


def from_minari(
  dataset_id: str, attributes: Mapping[str, Any] | None = None
) -> Demonstrations:
  """Reads a local Minari dataset; `demonstrations.write` makes it ours.

  Args:
    dataset_id: Minari's name.
    attributes: `task`, `main_task`, `collection`, `expert`, `seed` and
      `control_hz`, over those that `to_minari` stored.

  Raises:
    ValueError: there is no such dataset, it is damaged, or its observations
      or actions are not flat floats.
  """
  if dataset_id not in minari.list_local_datasets():
    raise ValueError(
      f"no local Minari dataset {dataset_id}; download it with: minari "
      f"download {dataset_id}"
    )
  try:
    dataset = minari.load_dataset(dataset_id)
    episodes = [one for one in dataset.iterate_episodes() if len(one.actions)]
  except (KeyError, OSError) as error:
    place = get_dataset_path(dataset_id)
    raise ValueError(
      f"the Minari dataset {place} is damaged or unfinished: {error}"
    ) from error
  for name in ("observation_space", "action_space"):
    space = getattr(dataset.spec, name)
    if not isinstance(space, gymnasium.spaces.Box) or len(space.shape) != 1:
      raise ValueError(f"{dataset_id}: {name} is {space}; valid: a flat Box")
  if not episodes:
    raise ValueError(f"{dataset_id} holds no step")
  stored = dict(dataset.storage.metadata).get(_KEY, "{}")
  return from_attempts(
    ((one.observations, one.actions, _success(one)) for one in episodes),
    {**json.loads(str(stored)), **(attributes or {})},
  )


def _episodes(data: Demonstrations) -> list[slice]:
  starts = np.flatnonzero(np.diff(data.episode, prepend=data.episode[0] - 1))
  ends = [*starts[1:], len(data)]
  return [slice(a, b) for a, b in zip(starts, ends, strict=True)]


def _buffer(data: Demonstrations, rows: slice) -> EpisodeBuffer:
  terminations = data.is_last[rows]
  truncations = np.zeros_like(terminations)
  truncations[-1] = not terminations[-1]
  last = data.next_observation[rows][-1:]
  return EpisodeBuffer(
    observations=np.concatenate([data.observation[rows], last]),
    actions=data.action[rows],
    rewards=np.zeros(len(terminations), np.float32),
    terminations=terminations,
    truncations=truncations,
  )


def _success(episode) -> np.ndarray:
  is_last = np.zeros(len(episode.actions), bool)
  is_last[-1] = bool(episode.terminations[-1])
  return is_last


def _box(bound: float, size: int) -> gymnasium.spaces.Box:
  return gymnasium.spaces.Box(-bound, bound, (size,), np.float32)
