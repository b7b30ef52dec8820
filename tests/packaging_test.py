"""Import names of our own: strangers' modules of the same names stay theirs."""

import os
import pathlib
import subprocess
import sys
import tomllib

from absl.testing import absltest

_ROOT = pathlib.Path(__file__).resolve().parents[1]
_ROOMS = ("agents", "launch", "lfgp_dmc", "tasks")
_STRANGERS = ("tasks.py", "agents/__init__.py", "launch.py", "datasets.py")
_SCRIPT = """
import agents, datasets, launch, tasks
assert {module.OWNER for module in (agents, datasets, launch, tasks)} == {"me"}
import lfgp_dmc
from lfgp_dmc.agents import lfgp
from lfgp_dmc.launch import configs
lfgp_dmc.load("reach", seed=0).close()
print("fine")
"""
_ENVIRONMENT = """
import datasets
from lfgp_dmc import toy
assert datasets.OWNER == "me"
make = toy.PointEnvironment
"""


class PackagingTest(absltest.TestCase):
  def test_every_folder_of_code_is_a_package_of_the_distribution(self):
    folders = {
      path.parent.relative_to(_ROOT)
      for room in _ROOMS
      for path in (_ROOT / room).rglob("*.py")
    }
    names = {".".join(folder.parts) for folder in folders}
    wanted = {
      name if name.startswith("lfgp_dmc") else f"lfgp_dmc.{name}"
      for name in names
    }
    project = tomllib.loads((_ROOT / "pyproject.toml").read_text())
    self.assertCountEqual(project["tool"]["setuptools"]["packages"], wanted)

  def test_a_script_beside_modules_of_the_same_names_uses_both(self):
    script = self._strangers() / "script.py"
    script.write_text(_SCRIPT)
    done = self._run([script])
    self.assertEqual(done.stdout, "fine\n", done.stderr)

  def test_a_command_finds_a_strangers_module_of_the_same_name(self):
    folder = self._strangers()
    (folder / "mine.py").write_text(_ENVIRONMENT)
    done = self._run(
      [
        _ROOT / "launch/train.py",
        "--config.algorithm=sacx",
        "--config.environment=mine:nothing",
        f"--run={folder / 'run'}",
      ],
      {"PYTHONPATH": str(folder)},
    )
    # Its module was imported, assertion included.
    self.assertIn("has no attribute 'nothing'", done.stderr)

  def _strangers(self) -> pathlib.Path:
    folder = pathlib.Path(self.create_tempdir().full_path)
    for name in _STRANGERS:
      path = folder / name
      path.parent.mkdir(exist_ok=True)
      path.write_text('OWNER = "me"\n')
    return folder

  def _run(self, arguments, environment=None):
    return subprocess.run(
      [sys.executable, *map(str, arguments)],
      capture_output=True,
      text=True,
      env={**os.environ, **(environment or {})},
    )
