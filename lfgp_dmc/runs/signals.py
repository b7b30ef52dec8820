"""A polite stop: the first signal requests it, a later one interrupts.

Schedulers signal a whole job, often each process twice: what comes within two
seconds is still the same request. SIGHUP stays ignored under nohup.
"""

import contextlib
import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from absl import logging

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_REPEAT = 2.0  # s
_last = -math.inf  # when a signal counted


class StopRequestedError(Exception):
  """A phase that can be given up was left because a stop is requested."""


class StopRequest:
  """Whether a stop is requested."""

  is_made = False

  def __bool__(self) -> bool:
    return self.is_made


_current = StopRequest()  # of the innermost `stop_request`


def poll() -> None:
  """Raises StopRequestedError if a stop is requested; for long phases."""
  if _current:
    raise StopRequestedError


@contextlib.contextmanager
def stop_request() -> Iterator[StopRequest]:
  """Turns SIGINT, SIGTERM and SIGHUP into a request while the block runs.

  A second signal raises KeyboardInterrupt. Python handles signals in the main
  thread alone: elsewhere nothing makes the request.
  """
  global _current, _last
  outer, request = _current, StopRequest()

  def act(number: int) -> None:
    if request:
      raise KeyboardInterrupt
    logging.warning(
      "%s: stopping at the next good moment; once more, after %.0f seconds, to "
      "stop now",
      signal.Signals(number).name,
      _REPEAT,
    )
    request.is_made = True

  before = _install(_counted(act))
  _current, _last = request, -math.inf
  try:
    yield request
  finally:
    _current = outer
    _restore(before)


def interrupt_once() -> None:
  """Makes signals KeyboardInterrupts for good; one in two seconds."""

  def act(number: int) -> None:
    raise KeyboardInterrupt

  _install(_counted(act))


def ignore() -> None:
  """Ignores signals from now on: nothing is left to interrupt."""
  _install(signal.SIG_IGN)


@contextlib.contextmanager
def held() -> Iterator[None]:
  """Holds signals back; processes started within never get them."""
  held_back: list[int] = []
  before = _install(lambda number, frame: held_back.append(number))
  mask = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)  # inherited
  try:
    yield
  finally:
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    _restore(before)
    for number in held_back[:1]:
      signal.raise_signal(number)


def _counted(act: Callable[[int], None]) -> Callable:
  def handle(number, frame):
    del frame
    global _last
    if time.monotonic() - _last >= _REPEAT:
      _last = time.monotonic()
      act(number)

  return handle


def _install(handler: Any) -> dict:
  """Sets the handler, in the main thread alone; returns those before."""
  if threading.current_thread() is not threading.main_thread():
    return {}
  before = {number: signal.getsignal(number) for number in _SIGNALS}
  if before[signal.SIGHUP] is signal.SIG_IGN:  # nohup
    del before[signal.SIGHUP]
  for number in before:
    signal.signal(number, handler)
  return before


def _restore(before: dict) -> None:
  for number, handler in before.items():
    signal.signal(number, handler)
