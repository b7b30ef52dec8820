"""Work shared among processes, with results in the order of the jobs."""

import collections
import concurrent.futures
import contextlib
import itertools
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from typing import Any

from lfgp_dmc import graphics

# Set before a worker imports anything.
_VARIABLES = {
  "OMP_NUM_THREADS": "1",
  "MKL_NUM_THREADS": "1",
  "OPENBLAS_NUM_THREADS": "1",
  "OMP_WAIT_POLICY": "PASSIVE",
  "LP_NUM_THREADS": "0",  # of Mesa's software GL
}


def ordered(
  make_state: Callable[[], Callable[[Any], Any]],
  jobs: Iterable[Any],
  workers: int,
  draws: bool = False,
) -> Generator[Any, None, None]:
  """Yields `make_state()(job)` for each job, in order.

  Args:
    make_state: called once in each process, such as for an environment; its
      result does the jobs, and may have a `close`. With several workers it must
      be picklable, and so must jobs and results.
    jobs: finite or endless: a few are in flight, and closing the generator
      ends the processes.
    workers: processes; 1 works in this one.
    draws: whether they make pictures.
  """
  if workers == 1:
    state = make_state()
    try:
      yield from map(state, jobs)
    finally:
      if hasattr(state, "close"):
        state.close()
    return
  if draws:
    graphics.allow_pictures()
  jobs = iter(jobs)
  with _variables({} if draws else {"MUJOCO_GL": "off"}):
    pool = concurrent.futures.ProcessPoolExecutor(
      workers,
      mp_context=multiprocessing.get_context("spawn"),
      initializer=_start,
      initargs=(make_state,),
    )
    try:
      flying = collections.deque(
        pool.submit(_work, job) for job in itertools.islice(jobs, 2 * workers)
      )
      while flying:
        result = flying.popleft().result()
        flying.extend(
          pool.submit(_work, job) for job in itertools.islice(jobs, 1)
        )
        yield result
    finally:
      pool.shutdown(cancel_futures=True)


_state: Callable[[Any], Any] | None = None  # one in each worker process


def _start(make_state: Callable[[], Callable[[Any], Any]]) -> None:
  """Initialises a worker: it ignores SIGINT and exits with its parent."""
  global _state
  signal.signal(signal.SIGINT, signal.SIG_IGN)
  threading.Thread(target=_end_with_parent, daemon=True).start()
  _state = make_state()


def _work(job: Any) -> Any:
  assert _state is not None
  return _state(job)


def _end_with_parent() -> None:
  parent = multiprocessing.parent_process()
  assert parent is not None
  parent.join()
  os._exit(1)


@contextlib.contextmanager
def _variables(more: Mapping[str, str]) -> Iterator[None]:
  """Sets the variables that spawned processes inherit, then restores ours.

  A worker's initializer would set them too late: unpickling its arguments
  imports.
  """
  ours = {**_VARIABLES, **more}
  before = {name: os.environ.get(name) for name in ours}
  os.environ.update(ours)
  try:
    yield
  finally:
    for name, value in before.items():
      if value is None:
        del os.environ[name]
      else:
        os.environ[name] = value
