"""The commands as an installed package offers them: `lfgp-train` and others."""

import os
import pathlib
import subprocess
import sys
import tomllib

from absl.testing import absltest

from lfgp_dmc.launch import command

_BIN = pathlib.Path(sys.executable).parent
_ROOT = pathlib.Path(command.__file__).resolve().parents[1]


class ScriptsTest(absltest.TestCase):
  def setUp(self):
    super().setUp()
    self.folder = self.create_tempdir().full_path

  def _call(self, line: str) -> subprocess.CompletedProcess:
    program, *arguments = line.split()
    return subprocess.run(
      [_BIN / program, *arguments],
      cwd=self.folder,
      capture_output=True,
      text=True,
    )

  def test_help_is_that_of_the_module(self):
    shown = self._call("lfgp-train --help").stdout
    script = subprocess.run(
      [sys.executable, _ROOT / "launch/train.py", "--help"],
      capture_output=True,
      text=True,
    ).stdout
    self.assertIn("Trains an agent by a flagfile", shown)
    self.assertIn("--preset", shown)
    # But for the program's name they are the same.
    heads = f"\n{_BIN / 'lfgp-train'}:\n", f"\n{_ROOT / 'launch/train.py'}:\n"
    self.assertEqual(shown.replace(heads[0], heads[1]), script)
    self.assertIn("--[no]resume", self._call("lfgp-train --helpfull").stdout)

  def test_evaluates_in_processes_of_its_own(self):
    done = self._call(
      "lfgp-evaluate --expert=scripted --tasks=reach --episodes=2 "
      "--workers=2 --output=out"
    )
    self.assertEqual(done.returncode, 0, done.stderr)
    self.assertRegex(done.stdout, r"reach +100.0% +2")
    self.assertEqual(os.listdir(f"{self.folder}/out"), ["evaluation.csv"])

  def test_bad_input_is_a_line_and_status_1(self):
    done = self._call("lfgp-plot --runs=no/run")
    self.assertEqual(done.returncode, 1)
    self.assertEqual(done.stderr, "error: no run folder no/run\n")

  def test_there_is_one_for_every_command(self):
    project = tomllib.loads((_ROOT / "pyproject.toml").read_text())["project"]
    commands = {
      f"lfgp_dmc.launch.{path.stem}:cli"
      for path in (_ROOT / "launch").glob("*.py")
      if "\ncli = " in path.read_text()
    }
    self.assertCountEqual(project["scripts"].values(), commands)


if __name__ == "__main__":
  absltest.main()
