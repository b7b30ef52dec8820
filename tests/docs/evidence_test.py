"""The index of `results/` has a row for all that is there, and nothing else."""

import csv
import pathlib

from absl.testing import absltest

from tests.docs import pages

_RESULTS = pages.ROOT / "results"
_TEXTS = {"README.md", "fidelity.md", "index.csv"}


class IndexTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    with open(_RESULTS / "index.csv", newline="", encoding="utf-8") as file:
      self._rows = list(csv.reader(file, strict=True))
    self._names = [row[0] for row in self._rows[1:]]

  def test_everything_has_a_row_or_is_in_a_folder_that_has_one(self):
    names = set(self._names)
    found = [
      path.relative_to(_RESULTS)
      for path in _RESULTS.rglob("*")
      if path.is_file() and path.name[0] != "." and path.name not in _TEXTS
    ]
    bare = [p for p in found if not {str(p), *map(str, p.parents)} & names]
    self.assertEmpty(bare)

  def test_every_row_is_whole_and_of_something_that_is_there(self):
    self.assertLen(set(self._names), len(self._names))
    self.assertEqual({len(row) for row in self._rows}, {6})
    gone = [n for n in self._names if not pathlib.Path(_RESULTS, n).exists()]
    self.assertEmpty(gone)


if __name__ == "__main__":
  absltest.main()
