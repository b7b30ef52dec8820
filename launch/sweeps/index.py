"""A sweep's index: a row a run, kept over all sweeps of a folder."""

import pathlib
from collections.abc import Sequence

from lfgp_dmc.data import csv_files
from lfgp_dmc.launch.sweeps import progress
from lfgp_dmc.launch.sweeps.jobs import DONE, FAILED, Job
from lfgp_dmc.runs import run_folder

COLUMNS = ("name", "algorithm", "main_task", "seed", "state", "attempts",
           "wall_s", "env_step", "success", "folder", "message")  # fmt: skip


class Index:
  """`index.csv` among the runs; methods raise ValueError if it is another's."""

  def __init__(self, runs: pathlib.Path):
    self.path = runs / "index.csv"

  def done(self) -> set[str]:
    """Names of runs that earlier sweeps finished, and that are still there."""
    return {
      row["name"]
      for row in self._rows()
      if row["state"] == DONE and _is_there(self.path.with_name(row["name"]))
    }

  def recall(self, jobs: Sequence[Job]) -> None:
    """Takes over what an earlier sweep knew, and finds what is done."""
    earlier = {row["name"]: row for row in self._rows()}
    for job in jobs:
      row = earlier.get(job.name, {"wall_s": "", "state": ""})
      job.wall_s = float(row["wall_s"] or job.wall_s)
      if not _is_there(job.folder) or job.wants_more_steps():
        continue
      if row["state"] == DONE or progress.is_done(job.folder):
        job.state = DONE

  def write(self, jobs: Sequence[Job]) -> None:
    """Writes a row a run, whole or not at all; other sweeps' rows stay.

    So does what another sweep did while the run failed here, as it must if both
    start it.
    """
    known = self._rows()
    done = {row["name"] for row in known if row["state"] == DONE}
    own = {j.name for j in jobs if j.state != FAILED or j.name not in done}
    rows: list[dict] = [row for row in known if row["name"] not in own]
    for job in jobs:
      if job.name not in own:
        continue
      step, success = progress.last_success(job.folder)
      found = {
        "env_step": step,
        "success": success,
        "wall_s": f"{job.wall_s:.0f}",
      }
      rows.append(
        {k: found[k] if k in found else getattr(job, k) for k in COLUMNS}
      )
    csv_files.write(self.path, COLUMNS, rows)

  def _rows(self) -> list[dict[str, str]]:
    if not self.path.is_file():
      return []
    columns, rows = csv_files.read(self.path)
    if columns != list(COLUMNS):
      raise ValueError(f"{self.path} is no sweep's: its columns are {columns}")
    return rows


def _is_there(run: pathlib.Path) -> bool:
  return (run / run_folder.CONFIG_NAME).is_file()
