"""Pictures of policies, and stored policies in user code and the viewer."""

import itertools
import json
import pathlib
import subprocess
import sys
import tempfile
from unittest import mock

import imageio.v2 as imageio
import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc import graphics, task_names
from lfgp_dmc.data import demonstrations
from lfgp_dmc.launch import (
  command,
  film_strips,
  policies,
  task_switch,
  training,
  view,
)
from lfgp_dmc.pictures.recorder import Look
from tests.launch import fixtures

_ROOT = pathlib.Path(command.__file__).resolve().parents[1]
_SMALL = ("--height=64", "--width=96", "--noshadows")


class _PolicyTest(absltest.TestCase):
  """With the policy folder of an agent that learned nothing."""

  @classmethod
  def setUpClass(cls):
    super().setUpClass()
    temporary = tempfile.TemporaryDirectory()
    cls.addClassCleanup(temporary.cleanup)
    cls.folder = pathlib.Path(temporary.name)
    dataset = fixtures.write_dataset(
      cls.folder / "data", task_names.task_set("stack"), 59, 4
    )
    config = fixtures.small_config(dataset, environment="", main_task="stack")
    cls.policy = cls.folder / "policy"
    cls.policy.mkdir()
    training.write_untrained_policy(config, cls.policy)


class PolicyTest(_PolicyTest):
  def test_loads_in_user_code(self):
    env = lfgp_dmc.load("stack", seed=0, time_limit=0.5)
    timestep = env.reset()
    act = {
      task: lfgp_dmc.load_policy(self.policy, task)
      for task in (None, "stack", "reach")
    }
    while not timestep.last():
      observation = lfgp_dmc.flatten(timestep.observation)
      action = {task: one(observation) for task, one in act.items()}
      self.assertEqual(action["reach"].shape, (4,))
      self.assertLessEqual(np.abs(action["reach"]).max(), 1)
      np.testing.assert_array_equal(action[None], action["stack"])
      self.assertFalse(np.array_equal(action["reach"], action["stack"]))
      timestep = env.step(action["reach"])
    env.close()
    with self.assertRaisesRegex(ValueError, "no intention 'insert'; it has"):
      lfgp_dmc.load_policy(self.policy, "insert")

  def test_acts_in_the_viewer_for_the_named_task(self):
    cast = policies.find(str(self.policy), "")
    reach = lfgp_dmc.load_policy(self.policy, "reach")
    seen = []

    def launch(environment, policy, title):
      timestep = environment.reset()
      for _ in range(3):
        action = policy(timestep)
        expected = reach(lfgp_dmc.flatten(timestep.observation))
        np.testing.assert_array_equal(action, expected)
        timestep = environment.step(action)
      seen.append(title)
      environment.close()

    viewer = mock.Mock(launch=launch)
    modules = {"dm_control.viewer": viewer}
    with (
      mock.patch.dict(sys.modules, modules),
      mock.patch("dm_control.viewer", viewer, create=True),
    ):
      view._open(cast, "reach")
    self.assertEqual(seen, ["LfGP-DMC: reach"])


class RenderingTest(_PolicyTest):
  def setUp(self):
    super().setUp()
    if graphics.fault():
      self.skipTest(graphics.fault())

  def _render(self, *arguments) -> subprocess.CompletedProcess:
    return subprocess.run(
      [
        sys.executable,
        _ROOT / "launch" / "render_policy.py",
        *_SMALL,
        *arguments,
      ],
      cwd=self.folder,
      capture_output=True,
      text=True,
      check=False,
    )

  def test_a_grid_shows_several_seeds_of_an_intention(self):
    done = self._render("--run=policy", "--task=reach", "--grid=1x3",
                        "--steps=8", "--every=4", "--output=g.gif")  # fmt: skip
    self.assertEqual(done.returncode, 0, done.stderr)
    frames = imageio.mimread(self.folder / "g.gif")
    self.assertEqual(frames[0].shape[:2], (64, 96))
    sidecar = json.loads((self.folder / "g.json").read_text())
    self.assertEqual(sidecar["task"], "reach")
    self.assertEqual([one["seed"] for one in sidecar["grid"]], [0, 1, 2])

  def test_low_control_rates_are_filmed_every_50_ms(self):
    done = self._render("--expert=scripted", "--task=reach", "--control_hz=5",
                        "--steps=3", "--every=2", "--output=h.gif")  # fmt: skip
    self.assertEqual(done.returncode, 0, done.stderr)
    sidecar = json.loads((self.folder / "h.json").read_text())
    self.assertEqual((sidecar["frames"], sidecar["fps"]), (7, 10.0))
    frames = imageio.mimread(self.folder / "h.gif")
    for one, next_one in itertools.pairwise(frames):
      self.assertFalse(np.array_equal(one, next_one))

  def test_strips_show_a_success(self):
    done = self._render("--what=strips", "--expert=scripted", "--task=reach",
                        "--strip_frames=4", "--output=s.png")  # fmt: skip
    self.assertEqual(done.returncode, 0, done.stderr)
    picture = imageio.imread(self.folder / "s.png")
    self.assertEqual(picture.shape, (64, 4 * 96, 3))
    (row,) = json.loads((self.folder / "s.json").read_text())["rows"]
    self.assertGreater(row["success_at"], 5)
    with self.assertRaisesRegex(command.UserError, "no success of stack in 1"):
      film_strips.rows(
        [policies.find(str(self.policy), "")], 0, Look(32, 32), 2, attempts=1
      )

  def test_a_reset_needs_no_actor(self):
    done = self._render(
      "--what=reset", "--task=insert", "--grid=1x2", "--output=r.png"
    )
    self.assertEqual(done.returncode, 0, done.stderr)
    picture = imageio.imread(self.folder / "r.png")
    self.assertEqual(picture.shape, (64, 96, 3))
    self.assertFalse(np.array_equal(picture[:, :48], picture[:, 48:]))
    for bad, message in (
      (["--grid=2"], "--grid=2; valid: ROWSxCOLUMNS"),
      (["--output=a.mp4"], "unknown format; valid: .png"),
      (["--camera=up"], "--camera=up is unknown; valid: "),
    ):
      done = self._render("--what=reset", *bad)
      self.assertEqual(done.returncode, 1)
      self.assertIn(message, done.stderr)

  def test_frames_tell_what_the_scheduler_chose(self):
    captions = []

    def label(frame, left, right, highlight):
      captions.append((left, right, highlight))
      return frame

    def switch(*_):
      return lambda step, timestep: "reach" if step < 2 else "close_gripper"

    cast = policies.find(str(self.policy), "")
    with (
      mock.patch("lfgp_dmc.pictures.video.label", label),
      mock.patch.object(task_switch, "make_switch", switch),
    ):
      clip = film_strips.play(
        cast, task_switch.SCHEDULED, 0, Look(32, 32), max_steps=2
      )
    self.assertEqual(clip.labels, ["reach", "reach", "close_gripper"])
    self.assertEqual(captions[0], ("scheduler: reach", "step 0", False))
    self.assertEqual(captions[2][0], "scheduler: close gripper")


class OwnArraysTest(absltest.TestCase):
  def test_the_readmes_lines_write_a_dataset(self):
    text = (_ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = [
      block.partition("```")[0]
      for block in text.split("```python\n")[1:]
      if "d.write(" in block.partition("```")[0]
    ]
    folder = pathlib.Path(self.create_tempdir().full_path)
    (folder / "data" / "mine").mkdir(parents=True)
    arrays = {
      "observation": np.zeros((5, 59), np.float32),
      "action": np.zeros((5, 4), np.float32),
      "next_observation": np.zeros((5, 59), np.float32),
      "episode": np.array([0, 0, 1, 1, 1], np.int32),
      "is_last": np.array([False, True, False, False, True]),
    }
    exec(code.replace('"data/mine', f'"{folder}/data/mine'), arrays)
    found = demonstrations.read_folder(folder / "data/mine", ["stack"], 59, 4)
    self.assertLen(found["stack"], 5)


if __name__ == "__main__":
  absltest.main()
