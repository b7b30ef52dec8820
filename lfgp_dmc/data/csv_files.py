"""The CSV files of a run: read, append, and cut back to a checkpoint."""

import csv
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

from lfgp_dmc.data import files

STEP_COLUMN = "env_step"
_LONGEST_LINE = 1 << 16  # bytes


def read(
  path: files.Path, is_log: bool = False
) -> tuple[list[str], list[dict[str, str]]]:
  """Reads columns and rows, as text.

  Args:
    path: of the file.
    is_log: whether a process writes it, which may have been killed: a last line
      that does not end is left out.

  Raises:
    ValueError: it is no CSV, or a line has not as many values as there are
      columns; the message names it.
  """
  try:
    text = pathlib.Path(path).read_bytes().decode("utf-8-sig")
    if is_log:
      text = text[: text.rfind("\n") + 1]
    reader = csv.DictReader(text.splitlines())
    columns, rows = list(reader.fieldnames or ()), []
    for row in reader:
      if None in row or None in row.values():
        raise csv.Error(
          f"line {reader.line_num} has not {len(columns)} values, one a column"
        )
      rows.append(row)
  except (UnicodeDecodeError, csv.Error) as error:
    raise ValueError(f"{path} is no CSV: {error}") from None
  return columns, rows


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
  """Appends rows to a log of the same columns; makes it if it is missing.

  A last line that does not end is cut off first, as `read` leaves it out.

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
    first = file.readline().removeprefix("\ufeff")
    found = next(csv.reader([first]))
    if found != list(columns):
      raise ValueError(f"{path} has columns {found}; expected {list(columns)}")
    _cut_torn_line(path)
    file.seek(0, os.SEEK_END)
    csv.DictWriter(file, columns, lineterminator="\n").writerows(rows)


def _cut_torn_line(path: pathlib.Path) -> None:
  with open(path, "rb+") as file:
    start = max(0, file.seek(0, os.SEEK_END) - _LONGEST_LINE)
    file.seek(start)
    if end := file.read().rfind(b"\n") + 1:
      file.truncate(start + end)


def truncate_after(path: files.Path, env_step: int) -> None:
  """Drops the rows later than `env_step`; nothing if there is no file.

  Raises:
    ValueError: the rows have no such number; the message names the file.
  """
  path = pathlib.Path(path)
  if not path.exists():
    return
  columns, rows = read(path, is_log=True)
  if not columns:
    path.unlink()
    return
  try:
    kept = [row for row in rows if int(row[STEP_COLUMN]) <= env_step]
  except (KeyError, ValueError) as error:
    raise ValueError(f"{path} is damaged: {error!r}") from None
  write(path, columns, kept)
