"""Memory of a learner whose replay is full: does it stay where it is."""

import pathlib
import tempfile
from collections.abc import Iterator

import numpy as np

from lfgp_dmc import observations, progress_bars
from lfgp_dmc.agents import synthetic
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch.benchmarks import learner
from lfgp_dmc.launch.configs import RunConfig

_ACTION_SIZE = 4
_CHUNK = 50_000  # rows filled at a time
_READINGS = 10
_ASIDE = pathlib.Path("runs")  # git ignores it; a temporary disk may be memory


def measure(config: RunConfig, updates: int) -> Iterator[tuple[str, float]]:
  """Fills a replay on disk to its capacity, then makes updates on it.

  Yields:
    `replay_rows`; `resident_gb/<updates so far>`: the process's resident
    memory, mapped pages counted (Linux: VmRSS), before the first update and
    after every tenth part of them; `resident_gb`: the most of these.
  """
  _ASIDE.mkdir(exist_ok=True)
  with tempfile.TemporaryDirectory(dir=_ASIDE) as folder:
    replay = Replay(
      config.replay_capacity,
      observations.OBSERVATION_SIZE,
      _ACTION_SIZE,
      pathlib.Path(folder) / "replay",
    )
    _fill(replay)
    yield "replay_rows", len(replay)
    agent = learner.make_agent(config, replay, config.threads or 1)
    readings = [resident_gb()]
    yield "resident_gb/0", readings[0]
    part = max(1, updates // _READINGS)
    counted = range(1, updates + 1)
    for update in progress_bars.bar(counted, desc="memory", unit="update"):
      agent.update()
      if update % part == 0:
        readings.append(resident_gb())
        yield f"resident_gb/{update}", readings[-1]
    yield "resident_gb", max(readings)


def resident_gb() -> float:
  """This process's resident memory, mapped files included, in GB (10^9)."""
  status = pathlib.Path("/proc/self/status").read_text()
  (line,) = (line for line in status.splitlines() if line.startswith("VmRSS"))
  return 1024e-9 * int(line.split()[1])


def _fill(replay: Replay) -> None:
  rows = synthetic.transitions(
    _CHUNK, observations.OBSERVATION_SIZE, _ACTION_SIZE
  )
  starts = range(0, replay.capacity, _CHUNK)
  for start in progress_bars.bar(starts, desc="filling", unit="chunk"):
    count = min(_CHUNK, replay.capacity - start)
    replay.add_batch(type(rows)(*(np.asarray(part)[:count] for part in rows)))
