"""Work shared among processes: order, faults, signals, and what is left."""

import multiprocessing
import os
import signal
import time

from absl.testing import absltest

from lfgp_dmc.acting import workers

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class _Player:
  """Does a job: squares it, raises, waits or dies."""

  def __call__(self, job):
    if job == "fail":
      raise ValueError("no such job")
    if job == "wait":
      time.sleep(60)
    if job == "die":
      os.kill(os.getpid(), signal.SIGKILL)
    return job * job


class WorkersTest(absltest.TestCase):
  def tearDown(self):
    self.assertEmpty(multiprocessing.active_children())
    super().tearDown()

  def test_results_come_in_order_and_signals_to_all_do_not_reach_them(self):
    results = workers.ordered(_Player, range(1, 40), 2)
    handlers = [signal.getsignal(number) for number in _SIGNALS]
    # At their start, too, when they import: both have two jobs by then.
    real = workers._shared

    def after_signals(crew, jobs):
      for worker in crew:
        for number in _SIGNALS:
          os.kill(worker.process.pid, number)
      return real(crew, jobs)

    with absltest.mock.patch.object(workers, "_shared", after_signals):
      first = next(results)
    self.assertEqual([first, *results], [n * n for n in range(1, 40)])
    self.assertEqual([signal.getsignal(n) for n in _SIGNALS], handlers)
    self.assertEmpty(signal.pthread_sigmask(signal.SIG_BLOCK, ()))

  def test_faults_are_raised_here(self):
    with self.assertRaisesRegex(ValueError, "no such job"):
      list(workers.ordered(_Player, [1, "fail", 2], 2))
    with self.assertRaisesRegex(
      workers.LostWorkerError, "killed by SIGKILL, as by the kernel"
    ):
      list(workers.ordered(_Player, [1, "die", 2], 2))

  def test_closing_ends_busy_workers_at_once(self):
    results = workers.ordered(_Player, [1, "wait", "wait", "wait"], 2)
    self.assertEqual(next(results), 1)
    start = time.monotonic()
    results.close()
    self.assertLess(time.monotonic() - start, 5)


if __name__ == "__main__":
  absltest.main()
