"""Checkpoints: whole or absent, verified when read, thinned as the run grows.

`checkpoints/000100080/` holds `arrays.safetensors`, `state.json` and
`manifest.json` (the size and SHA-256 of the other two). It is written aside,
flushed to disk and then renamed, so that a kill leaves no half of one.
"""

import hashlib
import pathlib
import shutil
from collections.abc import Mapping
from typing import Any

from absl import logging

from lfgp_dmc.data import array_files, files
from lfgp_dmc.runs import pytree

KEPT_LATEST = 3
KEPT_SHARES = 10  # one is kept for each tenth of the run

_ARRAYS = "arrays.safetensors"
_STATE = "state.json"
_MANIFEST = "manifest.json"
_PARTIAL = ".partial-"


class CheckpointError(ValueError):
  """A checkpoint that is damaged; the message names the file and the fault."""


def save(
  folder: files.Path,
  env_step: int,
  state: Mapping[str, Any],
  run_steps: int | None = None,
) -> pathlib.Path:
  """Writes one checkpoint, then removes those no longer kept.

  Args:
    folder: the run's `checkpoints/`; made if missing.
    env_step: names the checkpoint.
    state: nested dicts and lists of arrays and JSON values (see `pytree.py`).
    run_steps: length of the whole run; None keeps the last three only.

  Raises:
    OSError: it could not be written (the message names the file and its
      size); the earlier checkpoints are untouched.
    TypeError: a value that cannot be stored.
  """
  folder = pathlib.Path(folder)
  folder.mkdir(parents=True, exist_ok=True)
  for left_over in folder.glob(f"{_PARTIAL}*"):  # of a killed process
    shutil.rmtree(left_over, ignore_errors=True)
  final = folder / f"{env_step:09d}"
  aside = folder / f"{_PARTIAL}{final.name}"
  try:
    aside.mkdir()
    _write(aside, state)
    _replace(aside, final)
    files.flush_to_disk(folder)
  finally:
    shutil.rmtree(aside, ignore_errors=True)
  _thin_out(folder, run_steps)
  return final


def load(path: files.Path) -> dict[str, Any]:
  """Reads the state that `save` wrote, verified.

  Raises:
    CheckpointError: a file of it is missing, truncated or altered.
    PermissionError: a file of it may not be read.
  """
  path = pathlib.Path(path)
  _verify(path)
  try:
    arrays = array_files.read(path / _ARRAYS)
    return pytree.unpack(arrays, files.read_json(path / _STATE))
  except (ValueError, KeyError) as error:
    raise CheckpointError(f"{path}: {error}") from None


def latest(folder: files.Path) -> pathlib.Path | None:
  """The newest good checkpoint, if any; damaged ones are named in a warning."""
  for path in reversed(every(folder)):
    try:
      _verify(path)
    except CheckpointError as error:
      logging.warning("skipping a damaged checkpoint: %s", error)
      continue
    return path
  return None


def every(folder: files.Path) -> list[pathlib.Path]:
  """All checkpoints of a run, oldest first, unverified."""
  folder = pathlib.Path(folder)
  if not folder.is_dir():
    return []
  found = [path for path in folder.iterdir() if path.name.isdecimal()]
  return sorted(found, key=lambda path: int(path.name))


def _write(aside: pathlib.Path, state: Mapping[str, Any]) -> None:
  arrays, tree = pytree.pack(state)
  array_files.write(aside / _ARRAYS, arrays)
  files.write_json(aside / _STATE, tree)
  manifest = {name: _fingerprint(aside / name) for name in (_ARRAYS, _STATE)}
  files.write_json(aside / _MANIFEST, manifest)


def _replace(aside: pathlib.Path, final: pathlib.Path) -> None:
  """Renames `aside`; what was there goes, but only once it is done.

  There is something after a fall-back to an older checkpoint, and where a run's
  last evaluation was stopped and made up for.
  """
  if not final.exists():
    aside.rename(final)
    return
  old = final.with_name(f"{_PARTIAL}old-{final.name}")
  final.rename(old)
  try:
    aside.rename(final)
  except BaseException:
    old.rename(final)
    raise
  shutil.rmtree(old)


def _fingerprint(path: pathlib.Path) -> dict[str, Any]:
  with open(path, "rb") as file:
    digest = hashlib.file_digest(file, "sha256").hexdigest()
  return {"bytes": path.stat().st_size, "sha256": digest}


def _verify(path: pathlib.Path) -> None:
  try:
    manifest = files.read_json(path / _MANIFEST)
    for name in (_ARRAYS, _STATE):
      found, written = _fingerprint(path / name), manifest[name]
      if found != written:
        raise ValueError(
          f"{path / name} has {found['bytes']} bytes that are not the "
          f"{written['bytes']} that were written"
        )
  except PermissionError:  # it may be as good as any
    raise
  except (OSError, KeyError, TypeError, ValueError) as error:
    raise CheckpointError(f"{path}: {error}") from None


def _thin_out(folder: pathlib.Path, run_steps: int | None) -> None:
  found = every(folder)
  kept = set(found[-KEPT_LATEST:])
  if run_steps:
    for share in range(1, KEPT_SHARES + 1):
      step = share * run_steps / KEPT_SHARES
      reached = [path for path in found if int(path.name) >= step]
      kept.update(reached[:1])
  for path in found:
    if path not in kept:
      shutil.rmtree(path)
