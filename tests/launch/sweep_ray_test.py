"""Sweeps on a Ray cluster of two nodes, of which one is killed.

  TABLE=results/sweep/two_nodes.csv \
      python -m pytest tests/launch/sweep_ray_test.py

writes a row a run of the sweep that lost a node.
"""

import os
import pathlib
import re
import secrets
import shutil
import signal
import tempfile
from unittest import mock

from lfgp_dmc.data import csv_files
from lfgp_dmc.launch import command
from tests.fixtures import FolderTest
from tests.launch import sweep_fixtures

_STEPS = {"lfgp_right": 1200, "lfgp_transfer_right": 200}
_VARIABLES = {
  "RAY_AUTH_MODE": "token",
  "RAY_AUTH_TOKEN": secrets.token_hex(32),
  "RAY_USAGE_STATS_ENABLED": "0",
}
_STORE = 80 * 2**20  # B; about the least that Ray takes


class SweepRayTest(FolderTest):
  @classmethod
  def setUpClass(cls):
    super().setUpClass()
    # Its sockets' names may have about 100 characters.
    scratch = tempfile.mkdtemp(prefix="ray")
    cls.addClassCleanup(shutil.rmtree, scratch, ignore_errors=True)
    variables = {**_VARIABLES, "RAY_TMPDIR": scratch}
    cls.enterClassContext(mock.patch.dict(os.environ, variables))
    handler = signal.getsignal(signal.SIGTERM)  # Ray sets its own
    cls.addClassCleanup(signal.signal, signal.SIGTERM, handler)
    from ray import cluster_utils

    cls.cluster = cluster_utils.Cluster()
    cls.addClassCleanup(cls.cluster.shutdown)
    store = {"object_store_memory": _STORE}
    cls.first = cls.cluster.add_node(
      num_cpus=2, include_dashboard=False, **store
    )
    cls.second = cls.cluster.add_node(num_cpus=1, **store)

  def setUp(self):
    super().setUp()
    self.runs = self.folder / "runs"

  def _start(self, *arguments):
    sweep = sweep_fixtures.start(
      self.folder, f"--ray_address={self.cluster.address}", *arguments
    )
    self.addCleanup(sweep.communicate)
    self.addCleanup(sweep.kill)
    return sweep

  def _starts(self, name: str) -> list[tuple[str, str]]:
    """Arguments and Ray node of each attempt."""
    log = self.runs / f"{name}.log"
    text = log.read_text() if log.exists() else ""
    return re.findall(r"^\$ train\.py (.*)  # on .*, (\w+)$", text, re.M)

  def _checkpoint(self, name: str) -> int:
    """Step of the newest."""
    steps = (self.runs / name).glob("checkpoints/[0-9]*")
    return max((int(path.name) for path in steps), default=0)

  def _rows(self, name: str, file: str) -> list[dict[str, str]]:
    return csv_files.read(self.runs / name / file)[1]

  def test_a_killed_node_loses_no_run_and_repeats_none(self):
    sweep_fixtures.write_flagfiles(self.folder, lfgp=1200, lfgp_transfer=200)
    sweep = self._start(
      "--algorithms=lfgp,lfgp_transfer",
      "--seeds=0,1,2",
      "--start_from=lfgp_transfer_right:lfgp_right:config.transfer_from",
    )
    second = self.second.node_id
    lost = sweep_fixtures.wait_for(lambda: self._halfway_on(second))
    train = self._processes(f"--run=runs/{lost}")
    self.assertNotEmpty(train)
    self.cluster.remove_node(self.second, allow_graceful=False)
    for worker in train.values():  # the raylet's end alone may take it 5 s
      os.kill(worker, signal.SIGKILL)
    sweep_fixtures.wait_for(
      lambda: not train.keys() & self._processes(f"--run=runs/{lost}"), 5
    )
    reached = self._checkpoint(lost)
    kept = [row for row in self._rows(lost, "metrics.csv")
            if int(row["env_step"]) <= reached]  # fmt: skip
    self.assertNotEmpty(kept)

    _, errors = sweep.communicate(timeout=120)
    self.assertEqual(sweep.returncode, 0, errors)
    index = sweep_fixtures.index(self.folder)
    self._write_table(index)
    self.assertEqual({row["state"] for row in index.values()}, {"done"})
    self.assertLen(index, 6)
    for name, row in index.items():
      with self.subTest(name):
        last = _STEPS[name.rpartition("_")[0]]
        starts = self._starts(name)
        self.assertEqual(row["attempts"], "2" if name == lost else "1")
        self.assertLen(starts, int(row["attempts"]))
        log = (self.runs / f"{name}.log").read_text()
        self.assertEqual(log.count(f"success after {last}"), 1)
        evaluated = [(row["env_step"], row["task"], row["episode"])
                     for row in self._rows(name, "evaluation.csv")]  # fmt: skip
        self.assertCountEqual(
          evaluated,
          [(str(last), task, episode)
           for task in ("right", "left") for episode in ("0", "1")],
        )  # fmt: skip
        steps = [int(r["env_step"]) for r in self._rows(name, "metrics.csv")]
        self.assertEqual(steps, list(range(20, last + 1, 20)))
    (_, resumed) = self._starts(lost)
    self.assertEqual(resumed, (f"--run=runs/{lost} --resume",
                               self.first.node_id))  # fmt: skip
    # With their times: steps before the checkpoint were not made again.
    self.assertEqual(self._rows(lost, "metrics.csv")[: len(kept)], kept)

  def _halfway_on(self, node: str) -> str:
    """The first run on that node, once it has some checkpoints."""
    for log in self.runs.glob("*.log"):
      is_there = any(place == node for _, place in self._starts(log.stem))
      if is_there and self._checkpoint(log.stem) > 100:
        return log.stem
    return ""

  def _processes(self, argument: str) -> dict[int, int]:
    """Process -> parent, of those in our folder that have this argument."""
    found = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
      try:
        arguments = (process / "cmdline").read_text(errors="replace")
        is_ours = (process / "cwd").samefile(self.folder)
        _, _, stat = (process / "stat").read_text().rpartition(")")
      except OSError:  # it has ended, or is another user's
        continue
      if is_ours and argument in arguments.split("\0"):
        found[int(process.name)] = int(stat.split()[1])
    return found

  def _write_table(self, index: dict[str, dict[str, str]]) -> None:
    if "TABLE" not in os.environ:
      return
    nodes = {self.first.node_id: "first", self.second.node_id: "second, killed"}
    rows = [
      {
        "name": name,
        "attempts": row["attempts"],
        "nodes": "; ".join(nodes[node] for _, node in self._starts(name)),
        "seconds": row["wall_s"],
        "state": row["state"],
      }
      for name, row in index.items()
    ]
    csv_files.write(pathlib.Path(os.environ["TABLE"]), list(rows[0]), rows)

  def test_stops_with_a_checkpoint(self):
    sweep_fixtures.write_flagfiles(self.folder, lfgp=100_000)
    sweep = self._start("--seeds=0")
    sweep_fixtures.wait_for((self.runs / "lfgp_right_0" / "metrics.csv").exists)
    sweep.send_signal(signal.SIGINT)
    _, errors = sweep.communicate(timeout=60)
    self.assertEqual(sweep.returncode, command.INTERRUPTED, errors)
    row = sweep_fixtures.index(self.folder)["lfgp_right_0"]
    self.assertEqual(row["state"], "stopped")
    log = (self.runs / "lfgp_right_0.log").read_text()
    self.assertIn(f"stopped at {self._checkpoint('lfgp_right_0')} of", log)
