"""A polite stop: the first signal asks, the second interrupts."""

import contextlib
import signal
import threading
from collections.abc import Iterator

from absl import logging

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
  """Whether somebody asked the process to finish."""

  def __init__(self):
    self._asked = False

  def __bool__(self) -> bool:
    return self._asked

  def ask(self) -> None:
    """Asks to finish at the next good moment."""
    self._asked = True


@contextlib.contextmanager
def stop_request() -> Iterator[StopRequest]:
  """Turns SIGINT and SIGTERM into a request while the block runs.

  A second signal raises KeyboardInterrupt. Outside the main thread, where
  Python cannot handle signals, the request is only ever made by `ask`.
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
    request.ask()

  before = {number: signal.signal(number, handle) for number in _SIGNALS}
  try:
    yield request
  finally:
    for number, handler in before.items():
      signal.signal(number, handler)
