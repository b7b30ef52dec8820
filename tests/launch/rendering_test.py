"""Pictures of policies, and stored policies in user code and the viewer."""

import itertools
import json
import pathlib
import subprocess
import unittest
from unittest import mock

import imageio.v2 as imageio
import numpy as np
from absl.testing import absltest

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.launch import clips, command, policies, view
from lfgp_dmc.pictures import video
from lfgp_dmc.pictures.recorder import Look
from tests.fixtures import FolderTest
from tests.launch import fixtures

_ROOT = pathlib.Path(command.__file__).resolve().parents[1]
_POLICY = str(_ROOT / "results" / "policies" / "stack")


class PolicyTest(absltest.TestCase):
  def test_loads_in_user_code(self):
    env = lfgp_dmc.load("stack", seed=0, time_limit=0.5)
    timestep = env.reset()
    tasks = (None, "stack", "reach")
    policies_of = [lfgp_dmc.load_policy(_POLICY, task) for task in tasks]
    while not timestep.last():
      observation = lfgp_dmc.flatten(timestep.observation)
      default, stack, reach = (act(observation) for act in policies_of)
      self.assertEqual(reach.shape, (4,))
      self.assertLessEqual(np.abs(reach).max(), 1)
      np.testing.assert_array_equal(default, stack)
      self.assertFalse(np.array_equal(reach, stack))
      timestep = env.step(reach)
    with self.assertRaisesRegex(ValueError, "no intention 'insert'; it has"):
      lfgp_dmc.load_policy(_POLICY, "insert")

  def test_keys_of_the_viewer_switch_intentions(self):
    from dm_control.viewer import application, user_input

    stored = lfgp_dmc.load_policy(_POLICY)
    app, keys = mock.MagicMock(), {}
    app._input_map.bind.side_effect = lambda act, key: keys.update({key: act})
    shown = app._window.set_title

    def launch(environment, policy):
      timestep = environment.reset()
      for key, task in (
        (None, "reach"),
        (user_input.KEY_PAGE_DOWN, "lift"),
        (user_input.KEY_PAGE_UP, "reach"),
        (user_input.KEY_PAGE_UP, "close_gripper"),
      ):
        if key:
          keys[key]()
          self.assertEqual(shown.call_args.args, (f"LfGP-DMC: {task}",))
        expected = stored(lfgp_dmc.flatten(timestep.observation), task)
        np.testing.assert_array_equal(policy(timestep), expected)
        timestep = environment.step(expected)
        self.assertFalse(timestep.first())
      # A reset keeps the task.
      policy(environment.reset())
      np.testing.assert_array_equal(
        policy(timestep), stored(lfgp_dmc.flatten(timestep.observation), task)
      )

    app.launch.side_effect = launch
    with mock.patch.object(
      application, "Application", return_value=app
    ) as make:
      view._open(policies.find(_POLICY, ""), "reach")
    make.assert_called_once_with("LfGP-DMC: reach")
    app.launch.assert_called_once()


@unittest.skipIf(graphics.fault(), graphics.fault())
class RenderingTest(FolderTest):
  def _render(self, line: str) -> subprocess.CompletedProcess:
    small = "--height=64 --width=96 --noshadows"
    return fixtures.call(f"render_policy.py {small} {line}", self.folder)

  def _rendered(self, line: str, name: str):
    """The picture or frames, and what the sidecar says."""
    done = self._render(f"{line} --output={name}")
    self.assertEqual(done.returncode, 0, done.stderr)
    path = self.folder / name
    read = imageio.mimread if path.suffix == ".gif" else imageio.imread
    return read(path), json.loads(video.sidecar(path).read_text())

  def test_a_grid_shows_several_seeds_of_an_intention(self):
    frames, sidecar = self._rendered(
      f"--run={_POLICY} --task=reach --grid=1x3 --steps=3 --every=4", "g.gif"
    )
    self.assertEqual(frames[0].shape[:2], (64, 96))
    self.assertEqual(sidecar["task"], "reach")
    self.assertEqual([one["seed"] for one in sidecar["grid"]], [0, 1, 2])

  def test_low_control_rates_are_filmed_every_50_ms(self):
    frames, sidecar = self._rendered(
      "--expert=scripted --task=reach --control_hz=5 --steps=3 --every=2",
      "h.gif",
    )
    self.assertEqual((sidecar["frames"], sidecar["fps"]), (7, 10.0))
    for one, next_one in itertools.pairwise(frames):
      self.assertFalse(np.array_equal(one, next_one))

  def test_strips_show_a_success(self):
    picture, sidecar = self._rendered(
      "--what=strips --strip_frames=4 --expert=scripted --task=reach", "s.png"
    )
    self.assertEqual(picture.shape, (64, 4 * 96, 3))
    (row,) = sidecar["rows"]
    self.assertGreater(row["success_at"], 5)

  def test_a_reset_needs_no_actor(self):
    picture, _ = self._rendered(
      "--what=reset --task=insert --grid=1x2", "r.png"
    )
    self.assertEqual(picture.shape, (64, 96, 3))
    self.assertFalse(np.array_equal(picture[:, :48], picture[:, 48:]))
    printed = [self._render("--what=reset").stdout for _ in range(2)]
    self.assertEqual(
      printed,
      ["runs/videos/reset_stack.png\n", "runs/videos/reset_stack_2.png\n"],
    )
    for bad, message in (
      ("--grid=2", "--grid=2; valid: ROWSxCOLUMNS"),
      ("--output=a.mp4", "unknown format; valid: .png"),
      ("--camera=up", "unknown camera 'up'; valid: "),
    ):
      done = self._render(f"--what=reset {bad}")
      self.assertEqual(done.returncode, 1)
      self.assertIn(message, done.stderr)

  def test_frames_name_the_schedulers_choice(self):
    spec = policies.find(_POLICY, "")

    def choices(step, timestep):
      return "reach" if step < 2 else "close_gripper"

    with (
      mock.patch(
        "lfgp_dmc.pictures.video.label",
        side_effect=lambda frame, *_, **__: frame,
      ) as label,
      mock.patch.object(clips, "scheduled", lambda *_: choices),
    ):
      clip = clips.play(
        spec, clips.SCHEDULED, 0, Look(32, 32, every=4), max_steps=3
      )
    self.assertEqual(clip.switches, [(0, "reach"), (2, "close_gripper")])
    self.assertLen(clip.frames, 4)
    first, *_, last = label.call_args_list
    self.assertEqual(first.args[1:], ("scheduler: reach", "step 0"))
    self.assertEqual(first.kwargs, {"highlight": False})
    self.assertEqual(last.args[1], "scheduler: close gripper")
