"""Work shared among processes: order, faults, signals, and what is left."""

import multiprocessing
import os
import signal
import threading
import time
from unittest import mock

from absl.testing import absltest

from lfgp_dmc.acting import workers

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class _StubbornError(Exception):
  """Is pickled, and cannot be unpickled."""

  def __init__(self, what, why):
    super().__init__(f"{what}: {why}")


class _Player:
  """Does a job: squares it, raises, waits or dies."""

  def __call__(self, job):
    if job == "fail":
      raise ValueError("no such job")
    if job == "fail in a special way":
      raise _StubbornError("gripper", "stuck")
    if job == "give what cannot be sent":
      return threading.Lock()
    if job == "wait":
      time.sleep(60)
    if job == "die":
      os.kill(os.getpid(), signal.SIGKILL)
    return job * job


class WorkersTest(absltest.TestCase):
  def tearDown(self):
    self.assertEmpty(multiprocessing.active_children())
    super().tearDown()

  def test_a_signal_ends_the_start_of_many(self):
    class Started:
      def __init__(self, _):
        crew.append(self)
        self.is_killed = False
        if len(crew) == 2:
          signal.raise_signal(signal.SIGINT)

      def kill(self):
        self.is_killed = True

    crew: list[Started] = []
    # In the background of a shell it would be ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    self.addCleanup(signal.signal, signal.SIGINT, before)
    with (
      mock.patch.object(workers, "_Worker", Started),
      self.assertRaises(KeyboardInterrupt),
    ):
      next(workers.ordered(_Player, iter(range(40)), 9))
    self.assertEqual([each.is_killed for each in crew], [True, True])

  def test_results_come_in_order_whatever_signals_all_processes_get(self):
    real = workers._Worker.do

    def do_after_signals(worker, job):
      for number in _SIGNALS:  # the first ones before its imports
        os.kill(worker._process.pid, number)
      return real(worker, job)

    handlers = [signal.getsignal(number) for number in _SIGNALS]
    with mock.patch.object(workers._Worker, "do", do_after_signals):
      results = workers.ordered(_Player, iter(range(40)), 2)
      self.assertEqual([*results], [n * n for n in range(40)])
    self.assertEqual([signal.getsignal(n) for n in _SIGNALS], handlers)
    self.assertEmpty(signal.pthread_sigmask(signal.SIG_BLOCK, ()))

  def test_faults_are_raised_here(self):
    with self.assertRaisesRegex(ValueError, "no such job") as raised:
      list(workers.ordered(_Player, [1, "fail", 2], 2))
    self.assertIn("in __call__", raised.exception.__notes__[0])
    with self.assertRaisesRegex(
      workers.LostWorkerError, "was killed, as by the kernel"
    ):
      list(workers.ordered(_Player, [1, "die", 2], 2))

  def test_what_cannot_be_sent_is_told_as_text(self):
    for job, message in (
      ("fail in a special way", "_StubbornError: gripper: stuck"),
      ("give what cannot be sent", "cannot pickle '_thread.lock' object"),
    ):
      with self.assertRaisesRegex(Exception, message) as raised:
        list(workers.ordered(_Player, [1, job, 2], 2))
      self.assertIn("in a worker process", raised.exception.__notes__[0])

  def test_closing_ends_busy_workers_at_once(self):
    results = workers.ordered(_Player, [1, "wait", "wait", "wait"], 2)
    self.assertEqual(next(results), 1)
    start = time.monotonic()
    results.close()
    self.assertLess(time.monotonic() - start, 2)

  def test_a_worker_is_known_to_have_ended_whoever_else_waits_for_it(self):
    worker = workers._Worker(_Player)
    real, has_ended = os.waitpid, threading.Event()

    def wait_and_be_slow(pid, options):
      found = real(pid, options)
      if threading.current_thread() is waiting and found[0]:
        has_ended.set()
        time.sleep(0.3)  # before it notes the status
      return found

    def die():
      with self.assertRaises(workers.LostWorkerError):
        worker.do("die")

    waiting = threading.Thread(target=die)
    with mock.patch.object(os, "waitpid", wait_and_be_slow):
      waiting.start()
      self.assertTrue(has_ended.wait(60))
      worker.kill()
      self.assertEqual(worker._process.exitcode, -signal.SIGKILL)
      waiting.join()

  def test_an_interrupt_leaves_no_process(self):
    def interrupt(number, frame):
      signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    self.addCleanup(signal.signal, signal.SIGINT, before)
    before = signal.signal(signal.SIGALRM, interrupt)
    self.addCleanup(signal.signal, signal.SIGALRM, before)
    for delay in (1e-6, 0.003, 0.01, 0.1):  # while they start, and later
      with self.assertRaises(KeyboardInterrupt):
        signal.setitimer(signal.ITIMER_REAL, delay)
        list(workers.ordered(_Player, [1, "wait", "wait"], 2))
      self.assertEmpty(multiprocessing.active_children())
      self.assertEmpty(signal.pthread_sigmask(signal.SIG_BLOCK, ()))
