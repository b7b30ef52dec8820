"""The GL backend is chosen before MuJoCo is imported, and consistently."""

import os
import subprocess
import sys
from unittest import mock

from absl.testing import absltest, parameterized

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.launch import set_up_graphics


def _in_new_process(arguments: str = "", **variables: str) -> list[str]:
  """The backend and both variables, after it was chosen."""
  names = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
  code = (
    "import os; from lfgp_dmc import graphics; "
    f"print(graphics.choose_backend({arguments}), os.environ['MUJOCO_GL'], "
    "os.environ.get('PYOPENGL_PLATFORM'))"
  )
  clean = {k: v for k, v in os.environ.items() if k not in names}
  done = subprocess.run(
    [sys.executable, "-c", code],
    env={**clean, **variables},
    capture_output=True,
    text=True,
    check=True,
  )
  return done.stdout.split()


class ChooseBackendTest(parameterized.TestCase):
  def test_takes_one_that_works_and_sets_both_variables(self):
    chosen, gl, platform = _in_new_process(PYOPENGL_PLATFORM="x11")
    self.assertEqual(chosen, gl)
    if chosen in ("egl", "osmesa"):
      self.assertEqual(platform, chosen)

  def test_nothing_is_loaded_where_no_picture_is_needed(self):
    self.assertEqual(_in_new_process("render=False")[:2], ["off", "off"])

  @parameterized.parameters(
    ("egl", "egl"),
    ("EGL", "egl"),
    ("GLFW ", "glfw"),
    ("1", "glfw"),
    ("0", "off"),
  )
  @mock.patch.object(graphics, "_egl_works", lambda: True)
  def test_what_the_user_set_is_kept(self, given, backend):
    variables = {"MUJOCO_GL": given, "PYOPENGL_PLATFORM": "x11"}
    with (
      mock.patch.dict(os.environ, variables, clear=True),
      mock.patch.dict(sys.modules),
    ):
      sys.modules.pop("dm_control._render", None)
      self.assertEqual(graphics.choose_backend(), backend)
      self.assertEqual(os.environ["MUJOCO_GL"], backend)
      platform = backend if backend == "egl" else "x11"
      self.assertEqual(os.environ["PYOPENGL_PLATFORM"], platform)

  @parameterized.parameters(
    ("nonsense", "valid: glfw, egl"), ("osmesa", "no OSMesa: unset it")
  )
  @mock.patch.object(graphics, "_osmesa_works", lambda: False)
  def test_what_cannot_be_is_refused(self, backend, message):
    with (
      mock.patch.dict(os.environ, {"MUJOCO_GL": backend}),
      self.assertRaisesRegex(ValueError, message),
    ):
      graphics.choose_backend()

  @parameterized.parameters("77", "x")
  def test_an_egl_device_that_is_not_there(self, device):
    with mock.patch.dict(
      os.environ, MUJOCO_GL="egl", MUJOCO_EGL_DEVICE_ID=device
    ):
      self.assertFalse(graphics._egl_works.__wrapped__())
      with mock.patch.object(graphics, "_egl_works", lambda: False):
        self.assertIn("unset MUJOCO_EGL_DEVICE_ID", graphics.fault())

  def test_a_display_that_is_gone(self):
    with mock.patch.dict(os.environ, MUJOCO_GL="glfw", DISPLAY=":9876"):
      self.assertIn("there is no display", graphics.fault())

  @parameterized.parameters((True, "osmesa"), (False, "off"))
  @mock.patch.dict(os.environ, clear=True)
  @mock.patch.object(graphics, "_egl_works", lambda: False)
  def test_falls_back_to_osmesa_then_to_none(self, has_osmesa, expected):
    with mock.patch.object(graphics, "_osmesa_works", lambda: has_osmesa):
      self.assertEqual(graphics._best(render=True, window=False), expected)

  @parameterized.parameters(
    ("off", True, "unset it"),
    ("off", False, "libegl1"),
    ("glfw", True, "there is no display"),
    ("gdi", True, "valid: glfw, egl, osmesa, off"),
  )
  def test_fault_says_what_to_do(self, backend, has_egl, message):
    with (
      mock.patch.dict(os.environ, {"MUJOCO_GL": backend}, clear=True),
      mock.patch.object(graphics, "works_without_display", lambda: has_egl),
    ):
      self.assertIn(message, graphics.fault())


class FirstImportTest(parameterized.TestCase):
  def _run(self, code):
    """In a new process, whose environment says nothing of graphics."""
    names = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
    clean = {k: v for k, v in os.environ.items() if k not in names}
    done = subprocess.run(
      [sys.executable, "-c", code], env=clean, capture_output=True, text=True
    )
    self.assertEqual(done.returncode, 0, done.stderr)

  @parameterized.parameters(
    "import mujoco, OpenGL.GL",
    "from dm_control import mujoco",
    "import lfgp_dmc.gymnasium",
  )
  def test_pictures_after(self, first):
    if not graphics.works_without_display():
      self.skipTest("neither EGL nor OSMesa works")
    code = (
      f"{first}\nimport lfgp_dmc\n"
      "env = lfgp_dmc.load('reach', 0, observations='vision')\n"
      "assert env.reset().observation['camera/front'].std() > 0\n"
    )
    if "gymnasium" in first:
      code = (
        f"import gymnasium\n{first}\n"
        "env = gymnasium.make('lfgp_dmc/Reach-v0', render_mode='rgb_array')\n"
        "env.reset()\nassert env.render().std() > 0\n"
      )
    self._run(code)

  @mock.patch.dict(os.environ, MUJOCO_GL="off")
  @mock.patch.object(graphics, "choose_backend", lambda: "off")
  def test_vision_without_pictures_is_refused(self):
    with self.assertRaisesRegex(ValueError, "MUJOCO_GL is 'off'"):
      lfgp_dmc.load("reach", observations="vision")

  def test_frames_are_drawn_after_a_command_chose_no_pictures(self):
    if not graphics.works_without_display():
      self.skipTest("neither EGL nor OSMesa works")
    code = (
      "from lfgp_dmc import graphics\n"
      "assert graphics.choose_backend(render=False) == 'off'\n"
      "import lfgp_dmc\n"
      "lfgp_dmc.load('reach', 0).reset()\n"
      "env = lfgp_dmc.load('reach', 0, observations='vision')\n"
      "assert env.reset().observation['camera/wrist'].std() > 0\n"
    )
    self._run(code)


class SetUpGraphicsTest(absltest.TestCase):
  @mock.patch.object(graphics, "works_without_display", lambda: False)
  @mock.patch.object(os, "geteuid", lambda: 1000)
  def test_without_rights_prints_the_command(self):
    checked = mock.Mock(stdout="False\n")
    with (
      mock.patch.object(subprocess, "run", return_value=checked) as run,
      mock.patch("builtins.print") as printed,
    ):
      self.assertEqual(set_up_graphics.main(), 0)
    run.assert_called_once()  # the check alone
    self.assertIn("apt-get install -y libegl1", printed.call_args.args[0])
