"""What the robot's cameras see, drawn cheaply: 64 x 64 in a millisecond or two.

These frames are for networks. They have no shadows and no smooth edges, and
show the arm by its collision shapes: its meshes have 40,000 triangles. Films
for people are drawn elsewhere, with all of that.
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from dm_control import _render
from dm_control.mujoco import wrapper

_MESHES, _SHAPES = 2, 3  # groups of geoms, see `entities/panda.py`


class Cameras:
  """Draws frames in a GL context of its own, made for the first frame.

  One context serves all cameras of a compiled world.
  """

  def __init__(self, elements: Mapping[str, Any], size: int):
    """Takes camera elements by name, and the frames' side in pixels."""
    self.names = tuple(elements)
    self._elements, self._size = elements, size
    self._model: Any = None  # that the context was made for
    self._rectangle = mujoco.MjrRect(0, 0, size, size)
    self._option, self._perturbation = mujoco.MjvOption(), mujoco.MjvPerturb()
    self._option.geomgroup[_MESHES] = 0
    self._option.geomgroup[_SHAPES] = 1

  def frame(self, name: str, physics) -> np.ndarray:
    """What a camera sees now, uint8 [size, size, 3]."""
    if self._model is not physics.model.ptr:
      self._prepare(physics)
    pixels = np.empty((self._size, self._size, 3), np.uint8)
    with self._gl.make_current() as thread:
      thread.call(self._draw, self._views[name], physics.data.ptr, pixels)
    return pixels[::-1].copy()  # GL's rows go upwards

  def _draw(self, view, data, pixels: np.ndarray) -> None:
    scene, context = self._scene.ptr, self._context.ptr
    mujoco.mjv_updateScene(
      self._model,
      data,
      self._option,
      self._perturbation,
      view,
      mujoco.mjtCatBit.mjCAT_ALL,
      scene,
    )
    mujoco.mjr_render(self._rectangle, scene, context)
    mujoco.mjr_readPixels(pixels, None, self._rectangle, context)

  def _prepare(self, physics) -> None:
    """Makes context, scene and views for a newly compiled world."""
    self._model = physics.model.ptr
    visual = self._model.vis
    whole, quality = visual.global_, visual.quality
    films = (whole.offwidth, whole.offheight, quality.offsamples,
             quality.shadowsize)  # fmt: skip
    whole.offwidth = whole.offheight = self._size
    quality.offsamples = quality.shadowsize = 0
    try:
      self._gl = _render.Renderer(self._size, self._size)
      self._context = wrapper.MjrContext(physics.model, self._gl)
    finally:  # films have a context of their own, made of the same model
      (whole.offwidth, whole.offheight, quality.offsamples,
       quality.shadowsize) = films  # fmt: skip
    self._scene = wrapper.MjvScene(model=physics.model)
    self._scene.ptr.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
    self._scene.ptr.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
    self._views = {}
    for name, element in self._elements.items():
      view = mujoco.MjvCamera()
      view.type = mujoco.mjtCamera.mjCAMERA_FIXED
      view.fixedcamid = int(physics.bind(element).element_id)
      self._views[name] = view
