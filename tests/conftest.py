"""What must be so before the tests import anything."""

import os
import pathlib

from absl import flags

from lfgp_dmc import agents, graphics, launch, tasks

# Of two checkouts in one virtual environment, parts of both would be tested.
_ROOT = pathlib.Path(__file__).resolve().parents[1]
for room in (graphics, agents, launch, tasks):
  assert pathlib.Path(str(room.__file__)).resolve().is_relative_to(_ROOT), (
    f"{room.__name__} is {room.__file__}, not of {_ROOT}: run make setup here"
  )

# Threads that wait for each other spin: one each, as in the workers.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The GL backend is fixed when MuJoCo is first imported.
graphics.choose_backend()

# Lets absltest make temporary folders under pytest, which parses no flags.
flags.FLAGS.mark_as_parsed()
