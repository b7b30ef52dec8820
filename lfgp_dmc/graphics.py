"""Chooses MuJoCo's rendering backend.

MuJoCo and dm_control read `MUJOCO_GL` at their first import. With no display
and no choice they take GLFW, warn, and fail at the first picture: call
`choose_backend` before importing them.
"""

import ctypes
import ctypes.util
import functools
import os
import sys

BACKENDS = ("glfw", "egl", "osmesa", "off")
# Mesa's EGL on Debian and Ubuntu; it needs no GPU.
PACKAGES = ("libegl1", "libegl-mesa0", "libgl1-mesa-dri", "libgles2",
            "libopengl0")  # fmt: skip

_INSTALL = (
  f"install Mesa's EGL (Debian, Ubuntu: apt-get install {' '.join(PACKAGES)})"
)
_GL = "MUJOCO_GL"
_OFF = ("off", "disable", "disabled", "false", "0")
_PLATFORM_DEVICE = 0x313F  # EGL_PLATFORM_DEVICE_EXT
_MOST_DEVICES = 16


def choose_backend(render: bool = True, window: bool = False) -> str:
  """Sets `MUJOCO_GL` and `PYOPENGL_PLATFORM` for this process and its children.

  A `MUJOCO_GL` that the user set is kept, and nothing changes once MuJoCo has
  been imported.

  Args:
    render: whether pictures are needed; without them nothing is loaded.
    window: whether they go to a window on a display.

  Returns:
    One of `BACKENDS`; "off" where pictures cannot be made, see `fault`.
  """
  chosen = os.environ.get(_GL, "").lower().strip()
  if chosen in _OFF:
    chosen = "off"
  if not chosen and not {"mujoco", "dm_control"} & set(sys.modules):
    chosen = _best(render, window)
    os.environ[_GL] = chosen
  if chosen in ("egl", "osmesa"):
    os.environ["PYOPENGL_PLATFORM"] = chosen
  return chosen or "glfw"


def fault() -> str:
  """Why this process cannot draw, and what to do; empty if it can."""
  chosen = os.environ.get(_GL, "").lower().strip()
  if chosen in _OFF:
    return f"no pictures: MUJOCO_GL is {chosen!r}; " + (
      "unset it" if works_without_display() else _INSTALL
    )
  if chosen not in ("", *BACKENDS):
    return f"MUJOCO_GL is {chosen!r}; valid: {', '.join(BACKENDS)}"
  if chosen == "egl" and not _egl_works():
    return f"MUJOCO_GL is 'egl', but EGL does not work: {_INSTALL}"
  if chosen == "osmesa" and not _osmesa_works():
    return "MUJOCO_GL is 'osmesa', but there is no OSMesa: unset it"
  if chosen in ("", "glfw") and not has_display():
    return "MUJOCO_GL is 'glfw', but there is no display: unset it"
  return ""


def works_without_display() -> bool:
  """Whether EGL or OSMesa can make pictures here."""
  return _egl_works() or _osmesa_works()


def has_display() -> bool:
  """Whether a window could be opened."""
  if sys.platform != "linux":
    return True
  return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _best(render: bool, window: bool) -> str:
  if not (render or window):
    return "off"
  if window or sys.platform != "linux":
    return "glfw"
  if _egl_works():
    return "egl"
  if _osmesa_works():
    return "osmesa"
  return "glfw" if has_display() else "off"


def _osmesa_works() -> bool:
  return ctypes.util.find_library("OSMesa") is not None


@functools.cache
def _egl_works() -> bool:
  """Whether a device (a GPU or Mesa's software) opens without a display."""
  try:
    egl = ctypes.CDLL("libEGL.so.1")
    address = egl.eglGetProcAddress
  except (OSError, AttributeError):
    return False
  address.restype, address.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
  query = address(b"eglQueryDevicesEXT")
  get_display = address(b"eglGetPlatformDisplayEXT")
  if not query or not get_display:
    return False
  devices = (ctypes.c_void_p * _MOST_DEVICES)()
  count = ctypes.c_int(0)
  pointer, number = ctypes.c_void_p, ctypes.c_int
  query_type = ctypes.CFUNCTYPE(
    ctypes.c_uint, number, ctypes.POINTER(pointer), ctypes.POINTER(number)
  )
  display_type = ctypes.CFUNCTYPE(pointer, ctypes.c_uint, pointer, pointer)
  if not query_type(query)(_MOST_DEVICES, devices, ctypes.byref(count)):
    return False
  for device in devices[: count.value]:
    display = display_type(get_display)(_PLATFORM_DEVICE, device, None)
    # Left open: MuJoCo gets the same display.
    if display and egl.eglInitialize(ctypes.c_void_p(display), None, None):
      return True
  return False
