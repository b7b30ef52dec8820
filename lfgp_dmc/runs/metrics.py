"""The metrics of one run: `metrics.csv`, and TensorBoard events beside it."""

import pathlib
import time
from collections.abc import Mapping

from tensorboard.compat.proto import event_pb2, summary_pb2
from tensorboard.summary.writer import event_file_writer

from lfgp_dmc.data import csv_files, files
from lfgp_dmc.runs.run_folder import RunFolder


class MetricsLog:
  """Appends rows whose columns are fixed by the first one."""

  def __init__(self, folder: files.Path):
    """Opens the log of a run's folder, and continues one that exists."""
    self._path = RunFolder(pathlib.Path(folder)).metrics
    self._columns: list[str] = []
    if self._path.exists():
      self._columns, _ = csv_files.read(self._path, is_log=True)
    self._events = event_file_writer.EventFileWriter(
      str(self._path.parent / "tensorboard")
    )

  def write(self, row: Mapping[str, float]) -> None:
    """Appends `env_step` and metrics by name; a missing one is left empty.

    Raises:
      ValueError: a column that the first row did not have.
    """
    if csv_files.STEP_COLUMN not in row:
      raise ValueError(f"a metrics row needs {csv_files.STEP_COLUMN!r}")
    self._columns = self._columns or list(row)
    unknown = [name for name in row if name not in self._columns]
    if unknown:
      raise ValueError(
        f"{self._path}: columns {unknown} were not in the first row, which "
        "fixes them"
      )
    csv_files.append(self._path, self._columns, [row])
    self.write_scalars(int(row[csv_files.STEP_COLUMN]), row)

  def write_scalars(self, env_step: int, values: Mapping[str, float]) -> None:
    """Sends values to TensorBoard alone."""
    summary = summary_pb2.Summary(
      value=[
        summary_pb2.Summary.Value(tag=name, simple_value=float(value))
        for name, value in values.items()
        if name != csv_files.STEP_COLUMN
      ]
    )
    with files.naming(self._path.parent / "tensorboard"):
      self._events.add_event(
        event_pb2.Event(wall_time=time.time(), step=env_step, summary=summary)
      )
      self._events.flush()

  def truncate_after(self, env_step: int) -> None:
    """Drops rows and events after `env_step`, where a resumed run goes on."""
    csv_files.truncate_after(self._path, env_step)
    # TensorBoard hides older events from the step of a START event on.
    start = event_pb2.SessionLog(status=event_pb2.SessionLog.START)
    self._events.add_event(
      event_pb2.Event(
        wall_time=time.time(), step=env_step + 1, session_log=start
      )
    )
    self._events.flush()

  def close(self) -> None:
    """Closes the TensorBoard file; the CSV is never left open."""
    self._events.close()
