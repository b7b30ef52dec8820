"""Progress bars, which are sparse plain lines unless a terminal shows them."""

import math
import sys
import time
from collections.abc import Iterable
from typing import Any

import tqdm

_EVERY = 30.0  # s between lines, of all bars together
_LINE = (
  "{desc}: {n_fmt} of {total_fmt} {unit}s, {rate_fmt}, {remaining} left"
  "{postfix}"
)
_ENDLESS = "{desc}: {n_fmt} {unit}s, {rate_fmt}, {elapsed} so far{postfix}"


class _Lines(tqdm.tqdm):
  """Progress for logs; none in the first 30 s, and nothing at the end."""

  _printed = -math.inf  # when the last line was, of any bar

  def display(self, msg: str | None = None, pos: int | None = None) -> bool:
    """Prints a line if one is due."""
    now = time.time()
    if msg is None and now - max(self.start_t, _Lines._printed) >= _EVERY:
      _Lines._printed = now
      print(self, file=self.fp, flush=True)
    return False


def bar(
  iterable: Iterable | None = None, *, show: bool = True, **options: Any
) -> tqdm.tqdm:
  """A bar of tqdm on standard error; `options` are tqdm's."""
  if sys.stderr.isatty():
    return tqdm.tqdm(iterable, disable=not show, **options)
  is_endless = iterable is None and options.get("total") is None
  line = _ENDLESS if is_endless else _LINE
  options |= {"mininterval": _EVERY, "delay": _EVERY, "bar_format": line}
  return _Lines(iterable, disable=not show, **options | {"leave": False})
