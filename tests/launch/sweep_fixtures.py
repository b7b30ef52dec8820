"""Toy runs for the tests of sweeps."""

import pathlib
import subprocess
import sys
import time

from lfgp_dmc.data import csv_files
from lfgp_dmc.launch import command
from tests.launch import fixtures

_SCRIPT = pathlib.Path(command.__file__).with_name("sweep.py")


def write_flagfiles(folder: pathlib.Path, **env_steps: int) -> None:
  """Writes `flags/NAME.flags`: LfGP on the toy environment, NAME=STEPS."""
  dataset = fixtures.write_dataset(folder / "data")
  (folder / "flags").mkdir()
  for name, steps in env_steps.items():
    lines = [
      "--config.algorithm=lfgp",
      f"--config.demonstrations={dataset}",
      f"--config.environment={fixtures.POINT}",
      "--config.agent.batch_size=8",
      "--config.agent.networks.hidden_size=16",
      "--config.agent.reward.batch_size=8",
      "--config.agent.scheduler.xi=5",
      "--config.episode_steps=20",
      "--config.warm_up=20",
      "--config.updates_per_step=0.1",
      "--config.checkpoint_every=40",
      f"--config.env_steps={steps}",
      f"--config.evaluate_every={steps}",
      "--config.evaluation_episodes=2",
      "--config.evaluation_workers=1",
      "--config.log_every=20",
      "--config.replay_capacity=100000",
    ]
    (folder / "flags" / f"{name}.flags").write_text("\n".join(lines))


def start(folder: pathlib.Path, *arguments: str) -> subprocess.Popen:
  """Starts a sweep over the toy flagfiles of a folder, in that folder."""
  return subprocess.Popen(
    [
      sys.executable,
      _SCRIPT,
      "--flagfiles=flags",
      "--main_tasks=right",
      "--runs=runs",
      *arguments,
    ],
    cwd=folder,
    stdout=subprocess.PIPE,
    stderr=subprocess.PIPE,
    text=True,
  )


def index(folder: pathlib.Path) -> dict[str, dict[str, str]]:
  """Name -> row of the sweep's index."""
  rows = csv_files.read(folder / "runs" / "index.csv")[1]
  return {row["name"]: row for row in rows}


def wait_for(condition, seconds: float = 60):
  """Returns the condition's first true value."""
  end = time.monotonic() + seconds
  while not (value := condition()):
    assert time.monotonic() < end, "waited too long"
    time.sleep(0.05)
  return value
