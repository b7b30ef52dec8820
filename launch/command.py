"""What every command shares: start-up, and one clear line for bad input."""

import contextlib
import io
import logging
import os
import pathlib
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from absl import app, flags
from absl import logging as absl_logging

from lfgp_dmc import graphics, signals, threads
from lfgp_dmc.acting.workers import LostWorkerError
from lfgp_dmc.finite import NotFiniteError

_T = TypeVar("_T", str, int)

INTERRUPTED = 130  # exit status after SIGINT, SIGTERM or SIGHUP


class UserError(Exception):
  """Bad input: printed as it is, without a traceback, and exit status 1."""


def run(
  main: Callable[[], int | None],
  *,
  render: bool = False,
  window: bool = False,
  define_flags: Callable[[Sequence[str]], None] | None = None,
) -> None:
  """Runs a command and exits.

  Args:
    main: the command; its module's docstring and flags are the help, its result
      is the exit status.
    render: whether it makes pictures (see `graphics.choose_backend`).
    window: whether it opens a window.
    define_flags: defines flags that depend on other arguments; gets them with
      flagfiles expanded.
  """
  signals.catch()
  threads.wait_passively()
  threads.keep_memory()
  for stream in (sys.stdout, sys.stderr):  # of any encoding
    if isinstance(stream, io.TextIOWrapper):
      stream.reconfigure(errors="backslashreplace")
  try:
    graphics.choose_backend(render, window)
  except ValueError as error:
    sys.exit(_fail(str(error)))
  absl_logging.get_absl_handler().addFilter(_is_relevant)
  _show_help_of(main.__module__)

  def guarded_main(argv: Sequence[str]) -> int | None:
    if len(argv) > 1:
      return _fail(f"unexpected argument {argv[1]!r}; flags start with --")
    try:
      return guarded(main)
    finally:
      signals.ignore()

  def parse(argv: Sequence[str]) -> list[str]:
    try:
      arguments = _readable(flags.FLAGS.read_flags_from_files(list(argv[1:])))
      if define_flags is not None:
        define_flags(arguments)
      return flags.FLAGS([argv[0], *arguments])
    except (flags.Error, ValueError) as error:
      sys.exit(_fail(_with_flagfiles(str(error).removeprefix("ERROR:: "))))

  with _quiet_after_a_closed_pipe():
    app.run(guarded_main, flags_parser=parse)


def _with_flagfiles(message: str) -> str:
  """Says where ours lie after what says that a flagfile is missing."""
  if "open flagfile" not in message:
    return message
  folder = pathlib.Path(__file__).with_name("flags")
  names = ", ".join(sorted(path.name for path in folder.glob("*.flags")))
  return f"{message}; in {folder}: {names}"


def _readable(arguments: Sequence[str]) -> list[str]:
  """Expands `~` as in `--a=~/b,~/c`; raises ValueError for what is no text."""
  for argument in arguments:
    if re.search("[\ud800-\udfff]", argument):
      raise ValueError(
        f"{argument} is not text in this locale; set PYTHONUTF8=1 for UTF-8"
      )
  return [
    re.sub(r"(?<=[=,])~[^/,]*", lambda m: os.path.expanduser(m[0]), argument)
    for argument in arguments
  ]


def _show_help_of(module: str) -> None:
  """Makes `--help` that of a module which an installed script imported."""
  sys.modules["__main__"].__doc__ = sys.modules[module].__doc__
  for flag in flags.FLAGS.get_flags_for_module(module):
    flags.FLAGS.register_key_flag_for_module(sys.argv[0], flag)


def guarded(main: Callable[[], int | None]) -> int | None:
  """Calls a command; reports bad input and failing disks in a line.

  With --verbosity=1 the place is shown, too: it may be a fault of ours.
  """
  try:
    return main()
  except UserError as error:
    absl_logging.debug("raised here:", exc_info=error)
    return _fail(str(error))
  except BrokenPipeError:  # such as `| head`
    return 1
  except (OSError, NotFiniteError) as error:
    return _fail(str(error))
  except LostWorkerError as error:
    is_own = "workers" in flags.FLAGS
    flag = "--workers" if is_own else "--config.evaluation_workers"
    return _fail(f"{error}; fewer processes need less: {flag}=1")
  except KeyboardInterrupt:
    print("\ninterrupted", file=sys.stderr)
    return INTERRUPTED


@contextlib.contextmanager
def checked_input() -> Iterator[None]:
  """Turns errors of reading the user's input into a `UserError`.

  Elsewhere a ValueError is a fault of ours and deserves its traceback.
  """
  try:
    yield
  except (ValueError, FileNotFoundError, FileExistsError) as error:
    raise UserError(str(error)) from error


def cores() -> int:
  """Cores that this process may use."""
  if hasattr(os, "sched_getaffinity"):
    return len(os.sched_getaffinity(0))
  return os.cpu_count() or 1


def check_choice(flag: str, value: _T, valid: Sequence[_T]) -> _T:
  """Returns `value`; raises UserError that lists the valid ones."""
  if value not in valid:
    names = ", ".join(map(str, valid))
    raise UserError(f"--{flag}={value} is unknown; valid: {names}")
  return value


def _is_relevant(record: logging.LogRecord) -> bool:
  """Filters import-time log noise of libraries."""
  is_theirs = any(name in record.pathname for name in ("dm_control", "OpenGL"))
  return not is_theirs or record.levelno >= logging.WARNING


@contextlib.contextmanager
def _quiet_after_a_closed_pipe() -> Iterator[None]:
  """Exits with 1 and without a traceback after `| head`."""
  try:
    try:
      yield
    finally:
      sys.stdout.flush()  # at the exit nobody would catch what it raises
  except BrokenPipeError:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(1)


def _fail(message: str) -> int:
  print(f"error: {message}", file=sys.stderr)
  return 1
