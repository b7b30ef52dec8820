"""The GL backend is chosen before MuJoCo is imported, and consistently."""

import os
import subprocess
import sys
from unittest import mock

from absl.testing import absltest, parameterized

from lfgp_dmc import graphics
from lfgp_dmc.launch import set_up_graphics

_PRINT = (
  "import os; from lfgp_dmc import graphics; "
  "print(graphics.choose_backend({}), os.environ['MUJOCO_GL'], "
  "os.environ.get('PYOPENGL_PLATFORM'))"
)


def _in_new_process(arguments: str = "", **variables: str) -> list[str]:
  kept = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
  clean = {k: v for k, v in os.environ.items() if k not in kept}
  code = _PRINT.format(arguments)
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

  def test_falls_back_to_osmesa_then_to_none(self):
    with (
      mock.patch.object(graphics, "_egl_works", lambda: False),
      mock.patch.dict(os.environ, clear=True),
    ):
      with mock.patch.object(graphics, "_osmesa_works", lambda: True):
        self.assertEqual(graphics._best(render=True, window=False), "osmesa")
      with mock.patch.object(graphics, "_osmesa_works", lambda: False):
        self.assertEqual(graphics._best(render=True, window=False), "off")

  @parameterized.parameters(
    ("off", "unset it"),
    ("glfw", "there is no display"),
    ("gdi", "valid: glfw, egl, osmesa, off"),
  )
  def test_fault_says_what_to_do(self, backend, message):
    with (
      mock.patch.dict(os.environ, {"MUJOCO_GL": backend}, clear=True),
      mock.patch.object(graphics, "_egl_works", lambda: True),
    ):
      self.assertIn(message, graphics.fault())

  def test_fault_without_any_backend_names_the_packages(self):
    with (
      mock.patch.dict(os.environ, {"MUJOCO_GL": "off"}, clear=True),
      mock.patch.object(graphics, "works_without_display", lambda: False),
    ):
      self.assertIn("libegl1", graphics.fault())


class SetUpGraphicsTest(absltest.TestCase):
  def test_without_rights_prints_the_command(self):
    with (
      mock.patch.object(graphics, "works_without_display", lambda: False),
      mock.patch.object(os, "geteuid", lambda: 1000),
      mock.patch.object(subprocess, "run") as run,
      mock.patch("builtins.print") as printed,
    ):
      run.return_value.stdout = "False\n"
      self.assertEqual(set_up_graphics.main(), 0)
    self.assertEqual(run.call_count, 1)  # the check alone
    self.assertIn("apt-get install -y libegl1", printed.call_args.args[0])


if __name__ == "__main__":
  absltest.main()
