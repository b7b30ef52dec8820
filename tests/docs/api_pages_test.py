"""The API pages: every name of the facade is documented."""

import importlib.util
import subprocess
import sys
import unittest

from absl.testing import absltest

import lfgp_dmc
from tests import fixtures


@unittest.skipUnless(
  importlib.util.find_spec("pdoc"), "the extra docs is not installed"
)
class ApiPagesTest(fixtures.FolderTest):
  def test_the_facades_names_are_documented(self):
    out = self.folder / "pages"
    subprocess.run(
      [sys.executable, "-m", "pdoc", "-o", out, "-d", "google", "lfgp_dmc"],
      check=True,
    )
    page = (out / "lfgp_dmc.html").read_text()
    for name in lfgp_dmc.__all__:
      with self.subTest(name):
        self.assertIn(f'<section id="{name}">', page)
        documented = getattr(lfgp_dmc, name).__doc__
        if name.isupper():  # a constant
          documented = f"`{name}`" in lfgp_dmc.__doc__
        self.assertTrue(documented)


if __name__ == "__main__":
  absltest.main()
