"""Work shared among processes, with results in the order of the jobs."""

import collections
import contextlib
import itertools
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from multiprocessing import resource_tracker
from typing import Any, NamedTuple

from lfgp_dmc.runs import signals

ONE_THREAD = {
  "OMP_NUM_THREADS": "1",
  "MKL_NUM_THREADS": "1",
  "OPENBLAS_NUM_THREADS": "1",
  "OMP_WAIT_POLICY": "PASSIVE",
}
# Set before a worker imports anything.
_VARIABLES = {**ONE_THREAD, "MUJOCO_GL": "off"}
_PATIENCE = 0.5  # s, for processes that are ending


class LostWorkerError(RuntimeError):
  """A worker process died without an answer."""


class _Worker(NamedTuple):
  process: Any
  connection: Any  # our end of its pipe


def ordered(
  make_state: Callable[[], Callable[[Any], Any]],
  jobs: Iterable[Any],
  workers: int,
) -> Generator[Any, None, None]:
  """Yields `make_state()(job)` for each job, in order.

  Args:
    make_state: called once in each process, such as for an environment; its
      result does the jobs, and may have a `close`. With several workers it must
      be picklable, and so must jobs and results.
    jobs: small; finite or endless: a few are in flight, and closing the
      generator ends the processes.
    workers: processes; 1 works in this one. They get no signals: what is sent
      to all of a job is this process's to handle.

  Raises:
    LostWorkerError: a process was killed. What a job raises is raised as is.
  """
  if workers == 1:
    state = make_state()
    try:
      yield from map(state, jobs)
    finally:
      if hasattr(state, "close"):
        state.close()
    return
  crew: list[_Worker] = []
  try:
    with _variables(), signals.held():
      resource_tracker.ensure_running()  # lets signals through again
      with signals.held():
        crew.extend(_start(make_state) for _ in range(workers))
    yield from _shared(crew, jobs)
  finally:
    with signals.held():
      _end(crew)


def _start(make_state: Callable[[], Callable[[Any], Any]]) -> _Worker:
  context = multiprocessing.get_context("spawn")
  ours, theirs = context.Pipe()
  process = context.Process(target=_serve, args=(make_state, theirs))
  process.start()
  theirs.close()  # so that its death ends what we read
  return _Worker(process, ours)


def _shared(crew: Sequence[_Worker], jobs: Iterable[Any]) -> Iterator[Any]:
  """Hands the jobs out in turn, two a worker; yields results in order."""
  turns = zip(jobs, itertools.cycle(crew), strict=False)
  flying: collections.deque[_Worker] = collections.deque()

  def hand_out(count: int) -> None:
    for job, worker in itertools.islice(turns, count):
      with contextlib.suppress(OSError):  # it is dead, and found so below
        worker.connection.send(job)
      flying.append(worker)

  hand_out(2 * len(crew))
  while flying:
    worker = flying.popleft()
    try:
      is_done, result = worker.connection.recv()
    except (EOFError, OSError):
      raise LostWorkerError(_fate(worker.process)) from None
    hand_out(1)
    if not is_done:
      raise result
    yield result


def _fate(process) -> str:
  process.join(_PATIENCE)
  status = process.exitcode or 0
  if status >= 0:
    return f"a worker process ended with exit status {status}"
  name = signal.Signals(-status).name
  why = ", as by the kernel when memory runs out" if name == "SIGKILL" else ""
  return f"a worker process was killed by {name}{why}"


def _end(crew: Sequence[_Worker]) -> None:
  """Ends the workers: idle ones by themselves, busy ones by force."""
  deadline = time.monotonic() + _PATIENCE
  for worker in crew:
    worker.connection.close()
  for worker in crew:
    worker.process.join(max(0.0, deadline - time.monotonic()))
    worker.process.kill()
  for worker in crew:
    worker.process.join()


def _serve(make_state: Callable[[], Callable[[Any], Any]], connection) -> None:
  """Does jobs until the parent ends or hangs up."""
  threading.Thread(target=_end_with_parent, daemon=True).start()
  state: Any = None
  with contextlib.suppress(EOFError, OSError):
    while True:
      job = connection.recv()
      try:
        state = make_state() if state is None else state
        answer = True, state(job)
      except Exception as error:  # the parent raises it
        error.add_note(f"in a worker process:\n{traceback.format_exc()}")
        answer = False, error
      connection.send(answer)


def _end_with_parent() -> None:
  parent = multiprocessing.parent_process()
  assert parent is not None
  parent.join()
  os._exit(1)


@contextlib.contextmanager
def _variables() -> Iterator[None]:
  """Sets the variables that spawned processes inherit, then restores ours."""
  before = dict(os.environ)
  os.environ.update(_VARIABLES)
  try:
    yield
  finally:
    os.environ.clear()
    os.environ.update(before)
