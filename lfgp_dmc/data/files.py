"""Files that are whole or absent: write aside, flush to disk, then rename."""

import contextlib
import errno
import json
import os
import pathlib
import tempfile
from collections.abc import Iterator
from typing import Any

Path = str | os.PathLike[str]


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[pathlib.Path]:
  """Yields a temporary path that becomes `path` if the block succeeds.

  It lies in the same folder, which must exist, and has the same suffix. If the
  block raises (also KeyboardInterrupt) it is removed, and what was under the
  final name stays untouched.
  """
  final = pathlib.Path(path)
  aside = final.with_name(f".{final.stem}.{os.getpid()}.partial{final.suffix}")
  try:
    with naming(final):
      yield aside
      flush_to_disk(aside)
      os.replace(aside, final)
      flush_to_disk(final.parent)
  finally:
    aside.unlink(missing_ok=True)


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
  """Lets an OSError name this path; a full disk's names none."""
  try:
    yield
  except OSError as error:
    if error.errno is not None:
      error.filename = os.fspath(path)
    raise


def is_lack_of_room(error: OSError) -> bool:
  """Whether a disk, a quota or a limit of size is at its end."""
  return error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def check_writable(path: Path) -> None:
  """Raises OSError if a file cannot be written there; makes and alters none.

  Its folder need not exist yet.
  """
  path = pathlib.Path(path).absolute()
  try:
    if path.exists():
      open(path, "r+b").close()
    tempfile.TemporaryFile(dir=existing_parent(path)).close()
  except OSError as error:
    raise OSError(error.errno, error.strerror, os.fspath(path)) from None


def unused(path: pathlib.Path) -> pathlib.Path:
  """Such as `a.mp4`, or `a_2.mp4`, ... if that exists."""
  free, number = path, 1
  while free.exists():
    number += 1
    free = path.with_name(f"{path.stem}_{number}{path.suffix}")
  return free


def existing_parent(path: Path) -> pathlib.Path:
  """The innermost folder above `path` that exists."""
  parents = pathlib.Path(path).absolute().parents
  return next(parent for parent in parents if parent.exists())


def own(folder: Path, suffix: str) -> list[pathlib.Path]:
  """The files of a suffix, sorted; none that other systems or kills left."""
  found = sorted(pathlib.Path(folder).glob(f"*{suffix}"))
  return [path for path in found if path.name[0] != "."]


def flush_to_disk(path: Path) -> None:
  """Waits until a file's content, or a folder's list of names, is on disk."""
  descriptor = os.open(path, os.O_RDONLY)
  try:
    os.fsync(descriptor)
  finally:
    os.close(descriptor)


def write_bytes(path: Path, content: bytes) -> None:
  """Writes a file, whole or not at all.

  Raises:
    OSError: it cannot be written; for lack of room, the message has its size.
  """
  try:
    with replacing(path) as aside:
      aside.write_bytes(content)
  except OSError as error:
    if is_lack_of_room(error):
      size = f"it needs {len(content) / 1e6:.3g} MB"
      error.strerror = f"{error.strerror}; {size}"
    raise


def write_json(path: Path, value: Any) -> None:
  """Writes a JSON file, whole or not at all."""
  write_bytes(path, (json.dumps(value, indent=2) + "\n").encode())


def read_json(path: Path) -> Any:
  """Reads a JSON file.

  Raises:
    ValueError: it is not JSON; the message names the file.
  """
  try:
    return json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
  except (json.JSONDecodeError, UnicodeDecodeError) as error:
    raise ValueError(f"{os.fspath(path)} is not valid JSON: {error}") from None
