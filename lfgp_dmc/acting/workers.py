"""Work shared among processes, with results in the order of the jobs."""

import collections
import concurrent.futures
import contextlib
import itertools
import multiprocessing
import os
import pickle
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator
from multiprocessing import resource_tracker
from typing import Any

from lfgp_dmc import graphics, signals, threads

MakeState = Callable[[], Callable[[Any], Any]]


class LostWorkerError(RuntimeError):
  """A worker process died without an answer."""


def ordered(
  make_state: MakeState,
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
    workers: processes; 1 works in this one. They get no signals: what is sent
      to all of a job is this process's to handle.
    draws: whether they make pictures.

  Raises:
    LostWorkerError: a process was killed. What a job raises is raised as it is.
  """
  if workers == 1:
    yield from _in_this_process(make_state, jobs)
    return
  if draws:
    graphics.allow_pictures()
  jobs = iter(jobs)
  crew: list[_Worker] = []
  waiting = concurrent.futures.ThreadPoolExecutor(workers)  # each for one
  try:
    resource_tracker.ensure_running()  # its start lets signals through again
    with _variables(draws):
      for _ in range(workers):
        with signals.held():  # one at a time: many take minutes to start
          crew.append(_Worker(make_state))
    idle = collections.deque(crew)

    def do(job: Any) -> Any:
      worker = idle.popleft()
      try:
        return worker.do(job)
      finally:
        idle.append(worker)

    flying = collections.deque(
      waiting.submit(do, job) for job in itertools.islice(jobs, 2 * workers)
    )
    while flying:
      result = flying.popleft().result()
      flying.extend(
        waiting.submit(do, job) for job in itertools.islice(jobs, 1)
      )
      yield result
  finally:
    with signals.held():
      for worker in crew:
        worker.kill()
      waiting.shutdown(cancel_futures=True)


def _in_this_process(
  make_state: MakeState, jobs: Iterable[Any]
) -> Generator[Any, None, None]:
  state = make_state()
  try:
    yield from map(state, jobs)
  finally:
    if hasattr(state, "close"):
      state.close()


class _Worker:
  """A process that does one job at a time."""

  def __init__(self, make_state: MakeState):
    context = multiprocessing.get_context("spawn")
    self._connection, theirs = context.Pipe()
    self._process = context.Process(target=_serve, args=(make_state, theirs))
    # Two threads may wait for its end, of which one alone gets its status.
    self._ending = threading.Lock()
    self._process.start()
    theirs.close()  # so that we read its end

  def do(self, job: Any) -> Any:
    """Does a job."""
    try:
      self._connection.send(job)
      is_done, result = self._connection.recv()
    except (EOFError, OSError):
      raise LostWorkerError(self._fate()) from None
    if not is_done:
      raise result
    return result

  def kill(self) -> None:
    """Ends the process, idle or busy."""
    self._process.kill()
    self._status()

  def _status(self) -> int | None:
    """Waits for the process's end; returns its exit status."""
    with self._ending:
      self._process.join()
    return self._process.exitcode

  def _fate(self) -> str:
    status = self._status()
    if status == -signal.SIGKILL:
      return "a worker process was killed, as by the kernel out of memory"
    return f"a worker process ended with exit status {status}"


def _serve(make_state: MakeState, connection: Any) -> None:
  """Does jobs until the parent ends."""
  threading.Thread(target=_end_with_parent, daemon=True).start()
  state = None
  with contextlib.suppress(EOFError, OSError):
    while True:
      job = connection.recv()
      try:
        state = make_state() if state is None else state
        answer = True, state(job)
      except Exception as error:  # the parent raises it
        answer = False, _portable(error)
      try:
        connection.send(answer)
      except (pickle.PicklingError, TypeError, AttributeError) as error:
        connection.send((False, _portable(error)))


def _portable(error: Exception) -> Exception:
  """The error with its traceback; its text alone, if it does not pickle."""
  try:
    pickle.loads(pickle.dumps(error))  # some dump and do not load
  except Exception:
    error = RuntimeError("".join(traceback.format_exception_only(error)))
  error.add_note(f"in a worker process:\n{traceback.format_exc()}")
  return error


def _end_with_parent() -> None:
  parent = multiprocessing.parent_process()
  assert parent is not None
  parent.join()
  os._exit(1)


@contextlib.contextmanager
def _variables(draws: bool) -> Iterator[None]:
  """Sets the variables that spawned processes inherit, then restores ours.

  Later would be too late: what the processes unpickle first imports.
  """
  before = dict(os.environ)
  os.environ.update(threads.ONE)
  if not draws:
    os.environ["MUJOCO_GL"] = "off"
  try:
    yield
  finally:
    os.environ.clear()
    os.environ.update(before)
