"""Files that are whole or absent: write aside, flush to disk, then rename."""

import contextlib
import json
import os
import pathlib
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
    yield aside
    flush_to_disk(aside)
    os.replace(aside, final)
    flush_to_disk(final.parent)
  finally:
    aside.unlink(missing_ok=True)


def flush_to_disk(path: Path) -> None:
  """Waits until a file's content, or a folder's list of names, is on disk."""
  descriptor = os.open(path, os.O_RDONLY)
  try:
    os.fsync(descriptor)
  finally:
    os.close(descriptor)


def write_json(path: Path, value: Any) -> None:
  """Writes a JSON file, whole or not at all."""
  text = json.dumps(value, indent=2) + "\n"
  with replacing(path) as aside:
    aside.write_text(text, encoding="utf-8")


def read_json(path: Path) -> Any:
  """Reads a JSON file.

  Raises:
    ValueError: it is not JSON; the message names the file.
  """
  try:
    return json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
  except (json.JSONDecodeError, UnicodeDecodeError) as error:
    raise ValueError(f"{os.fspath(path)} is not valid JSON: {error}") from None
