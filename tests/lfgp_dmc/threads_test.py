"""How threads wait, in commands and where the user chose."""

import os
import platform
import subprocess
import sys
from unittest import mock

from absl.testing import absltest

from lfgp_dmc import threads

_COMMAND = """
import os, sys
from lfgp_dmc.launch import command
command.run(lambda: print(os.environ.get("OMP_WAIT_POLICY"), *sys.modules))
"""

_ALLOCATIONS = """
import resource
from lfgp_dmc import threads
threads.keep_memory()
def faults():
  blocks = [bytearray(1 << 22) for _ in range(16)]
  del blocks
  return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
before = [faults() for _ in range(3)]
print(faults() - before[-1])
"""


class ThreadsTest(absltest.TestCase):
  def test_commands_wait_passively_before_torch_is_loaded(self):
    kept = {k: v for k, v in os.environ.items() if k not in threads.ONE}
    done = subprocess.run(
      [sys.executable, "-c", _COMMAND], env=kept, capture_output=True, text=True
    )
    policy, *modules = done.stdout.split()
    self.assertEqual(policy, "PASSIVE", done.stderr)
    self.assertNotIn("torch", modules)

  def test_the_users_choice_stays(self):
    for name, value in (
      ("OMP_WAIT_POLICY", "ACTIVE"),
      ("GOMP_SPINCOUNT", "100"),
      ("KMP_BLOCKTIME", "200"),
    ):
      with mock.patch.dict(os.environ, {name: value}, clear=True):
        threads.wait_passively()
        self.assertEqual(dict(os.environ), {name: value})

  @absltest.skipUnless(platform.libc_ver()[0] == "glibc", "of glibc's malloc")
  def test_freed_memory_is_used_again_without_a_page_fault(self):
    done = subprocess.run(
      [sys.executable, "-c", _ALLOCATIONS], capture_output=True, text=True
    )
    self.assertLess(int(done.stdout), 100, done.stderr)
