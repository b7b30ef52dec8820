"""The GL backend is chosen before MuJoCo is imported, and consistently."""

import os
import subprocess
import sys
from unittest import mock

from absl.testing import absltest, parameterized

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

  @parameterized.parameters("egl", "osmesa", "glfw", "off")
  def test_what_the_user_set_is_kept(self, backend):
    found = _in_new_process(MUJOCO_GL=backend, PYOPENGL_PLATFORM="x11")
    platform = backend if backend in ("egl", "osmesa") else "x11"
    self.assertEqual(found, [backend, backend, platform])

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
