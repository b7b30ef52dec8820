"""The table of shared demonstrations against the paper's."""

import pathlib

import numpy as np
from absl.testing import absltest

from lfgp_dmc import dataset_table
from lfgp_dmc.data import demonstrations
from lfgp_dmc.task_names import task_set


def _write(folder, main_task, tasks, pairs, collection="reset"):
  folder.mkdir(parents=True)
  data = demonstrations.Demonstrations(
    np.zeros((pairs, 3), np.float32),
    np.zeros((pairs, 2), np.float32),
    np.zeros((pairs, 3), np.float32),
    np.zeros(pairs, np.int32),
    np.zeros(pairs, bool),
  )
  for task in tasks:
    attributes = {
      "task": task,
      "main_task": main_task,
      "collection": collection,
      "expert": "none",
      "seed": 0,
      "control_hz": 20,
    }
    demonstrations.write(folder / f"{task}.hdf5", data, attributes)
  return dataset_table.read(folder)


class DatasetTableTest(absltest.TestCase):
  def test_reuse_is_the_papers(self):
    folder = pathlib.Path(self.create_tempdir().full_path)
    datasets = [_write(folder / "stack_54", "stack", ["stack"], 54)]
    for main in ("insert", "bring", "stack"):
      datasets.append(_write(folder / main, main, task_set(main), 9))
    play = _write(folder / "p", "bring", task_set("bring"), 9, "play")
    rows = dataset_table.rows([*datasets, play])
    found = [
      (row["class"], row["main_task"], row["reusable"], row["single"],
       row["total"]) for row in rows
    ]  # fmt: skip
    self.assertEqual(
      found,
      [
        ("multitask", "stack", 45, 9, 54),
        ("multitask", "bring", 54, 0, 54),
        ("multitask", "insert", 54, 9, 63),
        ("multitask", "bring", 0, 54, 54),
        ("single-task", "stack", 0, 54, 54),
      ],
    )
    self.assertStartsWith(rows[0]["tasks"], "stack CLOSE_GRIPPER LIFT")
    text = dataset_table.markdown(rows)
    self.assertLen(text.splitlines(), 2 + len(rows))

  def test_a_folder_without_files_is_named(self):
    folder = self.create_tempdir().full_path
    with self.assertRaisesRegex(ValueError, f"no dataset in {folder}"):
      dataset_table.read(folder)


if __name__ == "__main__":
  absltest.main()
