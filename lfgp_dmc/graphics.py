"""Chooses MuJoCo's rendering backend.

dm_control reads `MUJOCO_GL` at its first import. With no display and no choice
it takes GLFW, warns, and fails at the first picture: every door calls
`choose_backend` before it builds an environment.
"""

import ctypes
import ctypes.util
import functools
import importlib
import os
import sys
import warnings

BACKENDS = ("glfw", "egl", "osmesa", "off")
# Mesa's EGL on Debian and Ubuntu; it needs no GPU.
PACKAGES = ("libegl1", "libegl-mesa0", "libgl1-mesa-dri", "libgles2",
            "libopengl0")  # fmt: skip

_INSTALL = (
  f"install Mesa's EGL (Debian, Ubuntu: apt-get install {' '.join(PACKAGES)})"
)
_GL = "MUJOCO_GL"
_PLATFORM = "PYOPENGL_PLATFORM"
_EGL_DEVICE = "MUJOCO_EGL_DEVICE_ID"
# dm_control's synonyms.
_OFF = ("off", "disable", "disabled", "false", "0")
_GLFW = ("glfw", "on", "enable", "enabled", "true", "1")
_PLATFORM_DEVICE = 0x313F  # EGL_PLATFORM_DEVICE_EXT
_MOST_DEVICES = 10  # as many as dm_control looks at

_off_is_ours = False  # whether "off" was our choice, not the user's


def choose_backend(render: bool = True, window: bool = False) -> str:
  """Sets `MUJOCO_GL` and `PYOPENGL_PLATFORM` for this process and its children.

  What the user set is kept, as is the backend of a dm_control that was imported
  before, if it can draw.

  Args:
    render: whether pictures are needed; without them nothing is loaded.
    window: whether they go to a window on a display.

  Returns:
    One of `BACKENDS`; "off" where pictures cannot be made, see `fault`.

  Raises:
    ValueError: dm_control could not be imported with the user's `MUJOCO_GL`.
  """
  global _off_is_ours
  imported = sys.modules.get("dm_control._render")
  chosen = _requested() or getattr(imported, "BACKEND", None) or ""
  if not chosen or (not os.environ.get(_GL) and _fault_of(chosen)):
    chosen = _best(render, window)
    _off_is_ours = not (render or window)
  if chosen not in ("glfw", "off") and (reason := _fault_of(chosen)):
    raise ValueError(reason)
  os.environ[_GL] = chosen
  if chosen in ("egl", "osmesa") and os.environ.get(_PLATFORM) != chosen:
    os.environ[_PLATFORM] = chosen
    for name in [m for m in sys.modules if m.partition(".")[0] == "OpenGL"]:
      del sys.modules[name]  # it was imported for another platform
  if imported and chosen != imported.BACKEND:
    importlib.reload(imported)
  return chosen


def allow_pictures() -> None:
  """Undoes a `choose_backend(render=False)`: frames are wanted after all."""
  if _off_is_ours:
    os.environ.pop(_GL, None)
    choose_backend()


def fault() -> str:
  """Why this process cannot draw, and what to do; empty if it can."""
  return _fault_of(_requested() or "glfw")


def _requested() -> str:
  """`MUJOCO_GL`, by its canonical name; empty if it is not set."""
  value = os.environ.get(_GL, "").lower().strip()
  return "off" if value in _OFF else "glfw" if value in _GLFW else value


def _fault_of(backend: str) -> str:
  install = _INSTALL
  if _EGL_DEVICE in os.environ:
    install = f"unset {_EGL_DEVICE}, or {install}"
  if backend not in BACKENDS:
    return f"{_GL} is {backend!r}; valid: {', '.join(BACKENDS)}"
  if backend == "off":
    return f"no pictures: {_GL} is 'off'; " + (
      "unset it" if works_without_display() else install
    )
  if backend == "egl" and not _egl_works():
    return f"{_GL} is 'egl', but EGL does not work: {install}"
  if backend == "osmesa" and not _osmesa_works():
    return f"{_GL} is 'osmesa', but there is no OSMesa: unset it"
  if backend == "glfw" and not has_display():
    return f"{_GL} is 'glfw', but there is no display: unset it"
  return ""


def works_without_display() -> bool:
  """Whether EGL or OSMesa can make pictures here."""
  return _egl_works() or _osmesa_works()


def has_display() -> bool:
  """Whether a window can be opened: a display may be named, but gone."""
  if sys.platform != "linux":
    return True
  if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    return False
  with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    try:
      import glfw

      return bool(glfw.init())
    except (ImportError, OSError, Warning):  # a GLFWError is a warning
      return False


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
  found, selected = devices[: count.value], os.environ.get(_EGL_DEVICE)
  if selected is not None:
    found = found[int(selected) :][:1] if selected.isdecimal() else []
  for device in found:
    display = display_type(get_display)(_PLATFORM_DEVICE, device, None)
    # Left open: MuJoCo gets the same display.
    if display and egl.eglInitialize(ctypes.c_void_p(display), None, None):
      return True
  return False
