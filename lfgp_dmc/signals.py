"""A polite stop: the first signal requests it, a later one interrupts.

Schedulers signal all processes of a job, often twice: what comes within two
seconds is still the same request. SIGHUP stays ignored under nohup.
"""

import contextlib
import math
import signal
import threading
import time
from collections.abc import Iterator
from typing import Any

from absl import logging

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_REPEAT = 2.0  # s
_last = -math.inf  # when a signal counted


class StopError(KeyboardInterrupt):
  """What may be given up was left, since a stop is requested."""


class StopRequest:
  """Whether a stop is requested."""

  def __init__(self):
    self.is_made = self.raises = False

  def __bool__(self) -> bool:
    return self.is_made

  @contextlib.contextmanager
  def at_once(self) -> Iterator[None]:
    """Within, a request raises StopError, also one that was made before."""
    self.raises = True
    try:
      if self:
        raise StopError
      yield
    finally:
      self.raises = False


_current: StopRequest | None = None  # of the running `stop_request`


@contextlib.contextmanager
def stop_request() -> Iterator[StopRequest]:
  """Turns SIGINT, SIGTERM and SIGHUP into a request while the block runs.

  A second signal raises KeyboardInterrupt. Python handles signals in the main
  thread alone: elsewhere nothing makes the request.
  """
  global _current, _last
  before = _install(_handle)
  _current, _last = StopRequest(), -math.inf
  try:
    yield _current
  finally:
    _current = None
    _restore(before)


def catch() -> None:
  """Turns signals outside `stop_request` into KeyboardInterrupts for good."""
  _install(_handle)


def ignore() -> None:
  """Ignores signals from now on: nothing is left to interrupt."""
  _install(signal.SIG_IGN)


@contextlib.contextmanager
def held() -> Iterator[None]:
  """Holds signals back; processes started within never get them."""
  came: list[int] = []
  before = _install(lambda number, frame: came.append(number))
  # Children inherit the mask. It does not bind our other threads, whose signals
  # come here: hence the handler too.
  mask = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
  try:
    yield
  finally:
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    _restore(before)
    for number in came[:1]:
      signal.raise_signal(number)


def _handle(number: int, frame: Any) -> None:
  del frame
  global _last
  if time.monotonic() - _last < _REPEAT:
    return
  _last = time.monotonic()
  if _current is None or _current:
    raise KeyboardInterrupt
  _current.is_made = True
  logging.warning(
    "%s: stopping once a checkpoint can be written; once more, after %.0f "
    "seconds, to stop now",
    signal.Signals(number).name,
    _REPEAT,
  )
  if _current.raises:
    raise StopError


def _install(handler: Any) -> dict[int, Any]:
  """Sets the handler, in the main thread alone; returns those before."""
  if threading.current_thread() is not threading.main_thread():
    return {}
  before: dict[int, Any] = {n: signal.getsignal(n) for n in _SIGNALS}
  if before[signal.SIGHUP] is signal.SIG_IGN:  # nohup
    del before[signal.SIGHUP]
  for number in before:
    signal.signal(number, handler)
  return before


def _restore(before: dict[int, Any]) -> None:
  for number, handler in before.items():
    signal.signal(number, handler)
