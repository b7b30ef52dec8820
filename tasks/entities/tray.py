"""The tray: a flat floor with two square pockets and four sloped walls."""

import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.entities.body import Body

_BASE_HALF = 0.002  # m, half thickness of the slab under the pockets
_WALL_HALF = 0.004  # m, half thickness of a sloped wall
_RGBA = (0.80, 0.79, 0.76, 1.0)


class Tray(Body):
  """A fixed tray of boxes; `geoms` is everything that a block can touch."""

  def _build(self, name: str = "tray") -> None:
    root = self._start_model(name)
    self._material = root.asset.add(
      "material", name="plastic", rgba=_RGBA, specular=0.1, shininess=0.1
    )
    floor = [self._add_base(), *map(self._add_floor, _floor_boxes())]
    self.wall_geoms = [self._add_wall(index) for index in range(4)]
    self.geoms = floor + self.wall_geoms
    for index in range(4):
      self._add_visual_wall(index)

  def _add_box(self, name, pos, size, **options):
    return self.mjcf_model.worldbody.add(
      "geom",
      name=name,
      type="box",
      pos=pos,
      size=size,
      material=self._material,
      **options,
    )

  def _add_base(self):
    top = ws.FLOOR_Z - ws.SLOT_DEPTH
    size = (ws.FLOOR_HALF, ws.FLOOR_HALF, _BASE_HALF)
    return self._add_box("base", (*ws.CENTRE_XY, top - _BASE_HALF), size)

  def _add_floor(self, box):
    name, (low_x, high_x), (low_y, high_y) = box
    half_z = ws.SLOT_DEPTH / 2
    pos = ((low_x + high_x) / 2, (low_y + high_y) / 2, ws.FLOOR_Z - half_z)
    size = ((high_x - low_x) / 2, (high_y - low_y) / 2, half_z)
    return self._add_box(name, pos, size)

  def _add_wall(self, index: int):
    """The wall whose slope rises towards +x turned by index x 90 degrees."""
    angle = ws.SLOPE_ANGLE
    run = (ws.TRAY_HALF - ws.FLOOR_HALF) / math.cos(angle)
    # Middle of the slope's face, then half a thickness below it.
    out = (ws.TRAY_HALF + ws.FLOOR_HALF) / 2 + _WALL_HALF * math.sin(angle)
    z = (ws.RIM_Z + ws.FLOOR_Z) / 2 - _WALL_HALF * math.cos(angle)
    turn = index * math.pi / 2
    x, y = ws.CENTRE_XY
    pos = (x + out * math.cos(turn), y + out * math.sin(turn), z)
    # Turned about z by `turn`, then tilted up about the wall's own -y.
    half_turn, half_tilt = turn / 2, -angle / 2
    quat = (
      math.cos(half_turn) * math.cos(half_tilt),
      -math.sin(half_turn) * math.sin(half_tilt),
      math.cos(half_turn) * math.sin(half_tilt),
      math.sin(half_turn) * math.cos(half_tilt),
    )
    size = (run / 2, ws.TRAY_HALF, _WALL_HALF)
    return self._add_box(f"wall_{index}", pos, size, quat=quat, group=4)

  def _add_visual_wall(self, index: int) -> None:
    """A mitred prism for the eye, where the collision boxes overlap."""
    inner, outer = ws.FLOOR_HALF, ws.TRAY_HALF
    low = ws.FLOOR_Z - ws.SLOT_DEPTH - 2 * _BASE_HALF
    turn = index * math.pi / 2
    cos, sin = math.cos(turn), math.sin(turn)
    centre_x, centre_y = ws.CENTRE_XY
    vertices: list[float] = []
    for side in (-1.0, 1.0):
      for x, z in (
        (inner, ws.FLOOR_Z),
        (outer, ws.RIM_Z),
        (outer, low),
        (inner, low),
      ):
        y = side * x
        vertices += (centre_x + x * cos - y * sin, centre_y + x * sin + y * cos)
        vertices.append(z)
    root = self.mjcf_model
    root.worldbody.add(
      "geom",
      type="mesh",
      mesh=root.asset.add("mesh", name=f"wall_{index}", vertex=vertices),
      material=self._material,
      mass=0,
    )


def _floor_boxes():
  """Boxes (name, x range, y range) that tile the floor around two pockets."""
  low_y = ws.CENTRE_XY[1] - ws.FLOOR_HALF
  high_y = ws.CENTRE_XY[1] + ws.FLOOR_HALF
  edge = -ws.FLOOR_HALF
  for name, (x, y) in (("green", ws.GREEN_XY), ("blue", ws.BLUE_XY)):
    left, right = x - ws.SLOT_HALF, x + ws.SLOT_HALF
    near, far = y - ws.SLOT_HALF, y + ws.SLOT_HALF
    yield f"floor_left_of_{name}", (edge, left), (low_y, high_y)
    yield f"floor_near_{name}", (left, right), (low_y, near)
    yield f"floor_far_{name}", (left, right), (far, high_y)
    edge = right
  yield "floor_right", (edge, ws.FLOOR_HALF), (low_y, high_y)
