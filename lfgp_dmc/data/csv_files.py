"""The CSV files of a run: read, append, and cut back to a checkpoint."""

import csv
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

from lfgp_dmc.data import files

STEP_COLUMN = "env_step"


def read(path: files.Path) -> tuple[list[str], list[dict[str, str]]]:
  """Reads columns and rows, as text; a torn last line is left out.

  Raises:
    ValueError: it is no CSV; the message names it.
  """
  try:
    text = pathlib.Path(path).read_bytes().decode()
    # A process that is killed while writing leaves a torn last line.
    whole = text[: text.rfind("\n") + 1]
    reader = csv.DictReader(whole.splitlines())
    columns = list(reader.fieldnames or ())
    return columns, [row for row in reader if None not in row.values()]
  except (UnicodeDecodeError, csv.Error) as error:
    raise ValueError(f"{path} is no CSV: {error}") from None


def write(
  path: files.Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]
) -> None:
  """Writes a whole file, or nothing."""
  with (
    files.replacing(path) as aside,
    open(aside, "w", newline="", encoding="utf-8") as file,
  ):
    writer = csv.DictWriter(file, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)


def append(
  path: files.Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]
) -> None:
  """Appends rows to a file of the same columns; makes it if it is missing.

  Raises:
    ValueError: the file has other columns.
  """
  path = pathlib.Path(path)
  if not path.exists() or not path.stat().st_size:
    write(path, columns, rows)
    return
  with (
    files.naming(path),
    open(path, "r+", newline="", encoding="utf-8") as file,
  ):
    found = next(csv.reader(file))
    if found != list(columns):
      raise ValueError(f"{path} has columns {found}; expected {list(columns)}")
    file.seek(0, os.SEEK_END)
    csv.DictWriter(file, columns, lineterminator="\n").writerows(rows)


def truncate_after(path: files.Path, env_step: int) -> None:
  """Drops the rows later than `env_step`; nothing if there is no file.

  Raises:
    ValueError: the rows have no such number; the message names the file.
  """
  path = pathlib.Path(path)
  if not path.exists():
    return
  columns, rows = read(path)
  if not columns:
    path.unlink()
    return
  try:
    kept = [row for row in rows if int(row[STEP_COLUMN]) <= env_step]
  except (KeyError, ValueError) as error:
    raise ValueError(f"{path} is damaged: {error!r}") from None
  write(path, columns, kept)
