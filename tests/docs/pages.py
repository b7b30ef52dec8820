"""The code and the commands of the pages, to be run by tests."""

import pathlib
import re
from typing import Any

from lfgp_dmc.launch import command

ROOT = pathlib.Path(command.__file__).resolve().parents[1]


def blocks(page: str, language: str) -> list[str]:
  """The page's blocks of code in that language ("": none), in order."""
  text = (ROOT / "docs" / page).read_text()
  found = re.findall(r"^```(.*)\n((?:.*\n)*?)```", text, re.MULTILINE)
  return [code for name, code in found if name == language]


def commands(page: str) -> list[str]:
  """The page's commands, without `python launch/`; one a line."""
  lines = "".join(blocks(page, "sh")).replace("\\\n", " ").splitlines()
  return [line.replace("python launch/", "") for line in lines]


def run(page: str, **names: Any) -> dict[str, Any]:
  """Runs all blocks of Python; returns the names that they define."""
  for code in blocks(page, "python"):
    exec(compile(code, page, "exec"), names)
  return names
