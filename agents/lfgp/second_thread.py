"""On two cores: a second thread, beside the one that learns."""

import concurrent.futures
from collections.abc import Callable
from typing import TypeVar

import torch

_Result = TypeVar("_Result")


class SecondThread:
  """Does what it is handed, one thing after the other.

  Each of the two has half of torch's threads: products as small as an update's
  are slower in parts than beside each other, and a thread that waits for the
  other twice an update loses less to busy neighbours than at every product.
  """

  def __init__(self, threads: int):
    """Shares `threads` out; at least one each."""
    own = max(1, threads // 2)
    torch.set_num_threads(own)
    self.generator = torch.Generator()  # of its noise
    self._executor = concurrent.futures.ThreadPoolExecutor(
      1, "learner", torch.set_num_threads, (own,)
    )

  def start(
    self, call: Callable[..., _Result], *args: object
  ) -> Callable[[], _Result]:
    """Starts a call; what it returns waits for the result."""
    return self._executor.submit(call, *args).result

  def seed_noise(self, generator: torch.Generator) -> None:
    """Seeds its noise from another generator; it must not be at work."""
    seed = torch.randint(2**62, (), generator=generator)
    self.generator.manual_seed(int(seed))


def at_once(
  call: Callable[..., _Result], *args: object
) -> Callable[[], _Result]:
  """Makes a call, where there is no second thread; see `start`."""
  result = call(*args)
  return lambda: result
