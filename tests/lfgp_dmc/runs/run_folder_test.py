"""A run's files: CSV and TensorBoard, folder and config, atomic writing."""

import datetime
from unittest import mock

from tensorboard.backend.event_processing import event_accumulator

from lfgp_dmc.data import csv_files, files
from lfgp_dmc.runs import run_folder
from lfgp_dmc.runs.metrics import MetricsLog
from tests import fixtures


class FilesTest(fixtures.FolderTest):
  def test_a_failed_write_keeps_what_was_there(self):
    path = self.folder / "a.json"
    files.write_json(path, {"kept": 1})
    with self.assertRaises(KeyboardInterrupt), files.replacing(path) as aside:
      aside.write_text("half")
      raise KeyboardInterrupt
    self.assertEqual(files.read_json(path), {"kept": 1})
    self.assertLen(list(self.folder.iterdir()), 1)

  def test_content_is_on_disk_before_it_has_the_name(self):
    path, flushed = self.folder / "a.json", []

    def flush(place):
      flushed.append((place.parent, path.exists()))

    with mock.patch.object(files, "flush_to_disk", flush):
      files.write_json(path, {})
    self.assertEqual(
      flushed, [(self.folder, False), (self.folder.parent, True)]
    )

  def test_a_full_disk_names_the_file(self):
    path = self.folder / "a.csv"
    csv_files.write(path, ["env_step"], [{"env_step": 1}])
    many = [{"env_step": 10**9}] * 9000
    for write in (csv_files.write, csv_files.append):
      before = csv_files.read(path)
      self.assertEqual(before[1], [{"env_step": "1"}])
      with fixtures.full_disk(), self.assertRaisesRegex(OSError, "a.csv"):
        write(path, ["env_step"], many)

  def test_a_full_disk_leaves_json_as_it_was(self):
    path = self.folder / "a.json"
    files.write_json(path, {"kept": 1})
    with fixtures.full_disk(), self.assertRaisesRegex(OSError, "a.json"):
      files.write_json(path, ["new"] * 9000)
    self.assertEqual(files.read_json(path), {"kept": 1})

  def test_a_damaged_csv_is_named(self):
    path = self.folder / "a.csv"
    for content in (b"env_step\n\xff\n", b"a\n1\n", b"env_step\nx\n"):
      path.write_bytes(content)
      with self.assertRaisesRegex(ValueError, "a.csv is"):
        csv_files.truncate_after(path, 0)

  def test_bad_json_is_named(self):
    path = self.folder / "a.json"
    path.write_text("{")
    with self.assertRaisesRegex(ValueError, "a.json is not valid JSON"):
      files.read_json(path)


class MetricsLogTest(fixtures.FolderTest):
  def _rows(self):
    return csv_files.read(self.folder / "metrics.csv")

  def test_rows_are_on_disk_at_once(self):
    log = MetricsLog(self.folder)
    log.write({"env_step": 500, "loss/critic": 1.5})
    log.write({"env_step": 1000})
    columns, rows = self._rows()
    self.assertEqual(columns, ["env_step", "loss/critic"])
    self.assertEqual([row["loss/critic"] for row in rows], ["1.5", ""])

  def test_a_later_unknown_column_is_named(self):
    log = MetricsLog(self.folder)
    log.write({"env_step": 500, "a": 1})
    with self.assertRaisesRegex(ValueError, r"\['b'\]"):
      log.write({"env_step": 1000, "b": 1})
    with self.assertRaisesRegex(ValueError, "env_step"):
      log.write({"a": 1})

  def test_resume_cuts_back_and_goes_on(self):
    log = MetricsLog(self.folder)
    for step in (500, 1000, 1500):
      log.write({"env_step": step, "a": step})
    log.close()
    with open(self.folder / "metrics.csv", "a") as file:
      file.write("2000,2")  # torn by a kill
    log = MetricsLog(self.folder)
    log.truncate_after(1000)
    log.write({"env_step": 1200, "a": 7})
    steps = [row["env_step"] for row in self._rows()[1]]
    self.assertEqual(steps, ["500", "1000", "1200"])
    log.close()
    events = event_accumulator.EventAccumulator(
      str(self.folder / "tensorboard")
    ).Reload()
    found = [(event.step, event.value) for event in events.Scalars("a")]
    self.assertEqual(found, [(500, 500), (1000, 1000), (1200, 7)])

  def test_tensorboard_reads_the_events(self):
    log = MetricsLog(self.folder)
    log.write({"env_step": 500, "loss/critic": 1.5})
    log.write_scalars(600, {"success/reach": 0.5})
    log.close()
    events = event_accumulator.EventAccumulator(
      str(self.folder / "tensorboard")
    ).Reload()
    (scalar,) = events.Scalars("loss/critic")
    self.assertEqual((scalar.step, scalar.value), (500, 1.5))
    self.assertEqual(events.Scalars("success/reach")[0].step, 600)

  def test_rows_are_appended_in_place_of_a_torn_one(self):
    path = self.folder / "a.csv"
    path.write_text("env_step,x\n1,2\n2,")
    csv_files.append(path, ["env_step", "x"], [{"env_step": 3, "x": 4}])
    self.assertEqual(path.read_text(), "env_step,x\n1,2\n3,4\n")

  def test_of_what_no_process_writes_every_line_counts(self):
    path = self.folder / "a.csv"
    path.write_bytes("\ufeffname,x\na,1\nb,2".encode())
    columns, rows = csv_files.read(path)
    self.assertEqual(columns, ["name", "x"])
    self.assertEqual([row["name"] for row in rows], ["a", "b"])
    for line in ("c", "c,3,4"):
      path.write_text(f"name,x\na,1\n{line}\n")
      with self.assertRaisesRegex(
        ValueError, "a.csv is no CSV: line 3 has not"
      ):
        csv_files.read(path)

  def test_other_columns_are_not_appended(self):
    path = self.folder / "a.csv"
    csv_files.append(path, ["env_step", "x"], [{"env_step": 1, "x": 2}])
    csv_files.append(path, ["env_step", "x"], [{"env_step": 2, "x": 3}])
    with self.assertRaisesRegex(ValueError, "expected"):
      csv_files.append(path, ["env_step"], [])
    self.assertLen(csv_files.read(path)[1], 2)


class RunFolderTest(fixtures.FolderTest):
  def test_create_read_resume(self):
    config = {"seed": 0, "agent": {"xi": 45, "sizes": (256, 256)}}
    run = run_folder.create(self.folder / "runs" / "a", config)
    self.assertEqual(run_folder.read_config(run.path)["seed"], 0)
    with self.assertRaisesRegex(ValueError, "--resume"):
      run_folder.create(run.path, config)
    with self.assertRaisesRegex(ValueError, "another process"):
      run_folder.resume(run.path, {"seed": 1})  # whatever else is wrong
    path = run.path
    del run
    self.assertEqual(run_folder.resume(path, config).path, path)

  def test_a_changed_config_is_refused_by_field(self):
    run = run_folder.create(self.folder / "a", {"seed": 0, "agent": {"xi": 45}})
    path = run.path
    del run
    with self.assertRaises(ValueError) as caught:
      run_folder.resume(path, {"seed": 0, "agent": {"xi": 9, "new": True}})
    self.assertIn("agent.xi (45, now 9)", str(caught.exception))
    self.assertIn("agent.new (unset, now true)", str(caught.exception))
    self.assertNotIn("seed", str(caught.exception))

  def test_what_the_run_added_is_no_change(self):
    run = run_folder.create(self.folder / "a", {"seed": 0})
    policy = {"tasks": ["reach"]}
    files.write_json(run.path / "config.json", {"seed": 0, "policy": policy})
    path = run.path
    del run
    run_folder.resume(path, {"seed": 0})

  def test_what_is_no_run_is_refused(self):
    for text, message in ((None, "has no"), ("{", "JSON"), ("[]", "no config")):
      if text is not None:
        (self.folder / "config.json").write_text(text)
      with self.assertRaisesRegex(ValueError, message):
        run_folder.resume(self.folder, {})
    with self.assertRaisesRegex(ValueError, "no run folder"):
      run_folder.read_config(self.folder / "none")

  def test_default_path_is_new(self):
    now = datetime.datetime(2022, 1, 31, 12, 0, 5)
    first = run_folder.default_path("lfgp", "stack", self.folder, now)
    self.assertEqual(first.name, "20220131_120005_000000_lfgp_stack")
    first.mkdir()
    second = run_folder.default_path("lfgp", "stack", self.folder, now)
    self.assertEqual(second.name, "20220131_120005_000000_lfgp_stack_2")
    now += datetime.timedelta(microseconds=1)
    together = run_folder.default_path("lfgp", "stack", self.folder, now)
    self.assertEqual(together.name, "20220131_120005_000001_lfgp_stack")
