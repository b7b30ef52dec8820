"""A polite stop: the first signal requests it, the second interrupts."""

import contextlib
import signal
import threading
from collections.abc import Iterator

from absl import logging

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
  """Whether a stop is requested."""

  def __init__(self):
    self._is_made = False

  def __bool__(self) -> bool:
    return self._is_made

  def make(self) -> None:
    """Requests a stop at the next good moment."""
    self._is_made = True


@contextlib.contextmanager
def stop_request() -> Iterator[StopRequest]:
  """Turns SIGINT and SIGTERM into a request while the block runs.

  A second signal raises KeyboardInterrupt. Python handles signals in the main
  thread alone: elsewhere nothing makes the request.
  """
  request = StopRequest()
  if threading.current_thread() is not threading.main_thread():
    yield request
    return

  def handle(number, frame):
    del frame
    if request:
      raise KeyboardInterrupt
    logging.warning(
      "%s: finishing this episode, then a checkpoint; once more to stop now",
      signal.Signals(number).name,
    )
    request.make()

  before = {number: signal.signal(number, handle) for number in _SIGNALS}
  try:
    yield request
  finally:
    for number, handler in before.items():
      signal.signal(number, handler)
