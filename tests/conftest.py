"""What must be so before the tests import anything."""

import os

from absl import flags

from lfgp_dmc import graphics

# Threads that wait for each other spin: one each, as in the workers.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The GL backend is fixed when MuJoCo is first imported.
graphics.choose_backend()

# Lets absltest make temporary folders under pytest, which parses no flags.
flags.FLAGS.mark_as_parsed()
