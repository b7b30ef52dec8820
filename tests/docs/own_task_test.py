"""The page on own tasks: a tenth block task, and a `dm_env` environment."""

import pathlib
import shutil
import subprocess
import sys

from absl.testing import absltest

import lfgp_dmc
from tests import fixtures
from tests.docs import pages
from tests.launch.fixtures import call

_PAGE = "own_task.md"
_FLAGS = pages.ROOT / "launch" / "flags"

# Of ten starts of Stack, from the hand to green.
_FARTHEST = """
import lfgp_dmc, numpy as np
env = lfgp_dmc.load("stack", 0)
seen = [lfgp_dmc.flatten(env.reset().observation) for _ in range(10)]
print(max(np.linalg.norm(s[:3] - s[19:22]) for s in seen))
"""


def _write_files(folder: pathlib.Path) -> list[str]:
  """Writes the page's files into `folder`; returns their names."""
  names = []
  for code in [*pages.blocks(_PAGE, "python"), *pages.blocks(_PAGE, "")]:
    name = code.partition("\n")[0].removeprefix("# ")
    names.append(name)
    if (folder / name).parent.is_dir():
      (folder / name).write_text(code)
  return names


def _apply(folder: pathlib.Path, changes: str) -> None:
  """Replaces lines as `--- FILE`, ` kept`, `-old` and `+new` say."""
  for part in changes.split("--- ")[1:]:
    name, *lines = part.splitlines()
    old = "\n".join(line[1:] for line in lines if line[0] != "+")
    new = "\n".join(line[1:] for line in lines if line[0] != "-")
    path = folder / name
    text = path.read_text()
    assert text.count(old) == 1, f"{name}: {old}"
    path.write_text(text.replace(old, new))


class OwnTaskTest(fixtures.FolderTest):
  def _call(self, line: str) -> str:
    """Runs a command of the page on the code in the test's folder."""
    script, *arguments = line.split()
    return self._python(str(self.folder / "launch" / script), *arguments)

  def _python(self, *arguments: str) -> str:
    done = subprocess.run(
      [sys.executable, *arguments],
      cwd=self.folder,
      env={"PYTHONPATH": str(self.folder), "MUJOCO_GL": "off"},
      capture_output=True,
      text=True,
    )
    self.assertEqual(done.returncode, 0, done.stderr)
    return done.stdout

  def test_a_tenth_task(self):
    # Laid out by import names, and by the folders that the page names.
    package = self.folder / "lfgp_dmc"
    ignored = shutil.ignore_patterns("__pycache__")
    for room in ("lfgp_dmc", "agents", "launch", "tasks"):
      target = package / ("" if room == "lfgp_dmc" else room)
      shutil.copytree(
        pages.ROOT / room, target, ignore=ignored, dirs_exist_ok=True
      )
      if room != "lfgp_dmc":
        (self.folder / room).symlink_to(target)
    _write_files(self.folder)
    for changes in pages.blocks(_PAGE, "diff"):
      _apply(self.folder, changes)
    evaluate, collect, train, *_ = pages.commands(_PAGE)
    table = self._call(f"{evaluate} --episodes=2")
    self.assertRegex(table, r"unstack +100.0% +2 ")
    farthest = float(self._python("-c", _FARTHEST))
    self.assertGreater(farthest, 0.1)  # m: as without the tenth task
    self._call(f"{collect} --pairs_per_task=60")
    short = "--config.env_steps=3 --config.evaluation_episodes=1"
    self._call(f"{train} {short}")
    policy = lfgp_dmc.load_policy(self.folder / "runs/unstack", "unstack")
    self.assertIsNotNone(policy)

  def test_an_environment_of_dm_control(self):
    self.assertContainsSubset(
      ["point_mass.py", "point.flags", "demonstrate.py"],
      _write_files(self.folder),
    )
    *_, demonstrate, check, lfgp, few = pages.commands(_PAGE)
    script = str(self.folder / demonstrate.removeprefix("python "))
    short = (
      "--config.env_steps=150 --config.warm_up=60 --config.random_steps=60"
      " --config.agent.networks.hidden_size=16 --config.evaluation_episodes=2"
    )
    outputs = []
    for line in (script, check, f"{lfgp} {short}", f"{few} {short}"):
      done = call(line.replace("launch/flags", str(_FLAGS)), self.folder)
      self.assertEqual(done.returncode, 0, done.stderr)
      outputs.append(done.stdout)
    self.assertIn("control rate: 10 Hz", outputs[1])
    for output in outputs[2:]:
      self.assertRegex(output, r"(?s)right .*left ")
    policy = lfgp_dmc.load_policy(self.folder / "runs/point_lfgp", "left")
    self.assertIsNotNone(policy)


if __name__ == "__main__":
  absltest.main()
