"""The tray: a flat floor with two square pockets and four sloped walls."""

import math

from dm_control import composer, mjcf

from lfgp_dmc.tasks import workspace as ws

_BASE_HALF = 0.002  # m, half thickness of the slab under the pockets
_WALL_HALF = 0.004  # m, half thickness of a sloped wall
_RGBA = (0.80, 0.79, 0.76, 1.0)


class Tray(composer.Entity):
  """A fixed tray of boxes; contacts are declared by the task, pair by pair."""

  def _build(self, name: str = "tray") -> None:
    self._mjcf_model = mjcf.RootElement(model=name)
    self._material = self._mjcf_model.asset.add(
      "material", name="plastic", rgba=_RGBA, specular=0.1, shininess=0.1
    )
    self._floor_geoms = [self._add_base()]
    self._floor_geoms += [self._add_floor(box) for box in _floor_boxes()]
    self._wall_geoms = [self._add_wall(index) for index in range(4)]
    for index in range(4):
      self._add_visual_wall(index)

  def _add_box(self, name, pos, size, **options):
    return self._mjcf_model.worldbody.add(
      "geom",
      name=name,
      type="box",
      pos=pos,
      size=size,
      material=self._material,
      contype=0,
      conaffinity=0,
      **options,
    )

  def _add_base(self):
    top = ws.FLOOR_Z - ws.SLOT_DEPTH
    x, y = ws.CENTRE_XY
    size = (ws.FLOOR_HALF, ws.FLOOR_HALF, _BASE_HALF)
    return self._add_box("base", (x, y, top - _BASE_HALF), size)

  def _add_floor(self, box):
    name, (low_x, high_x), (low_y, high_y) = box
    half_z = ws.SLOT_DEPTH / 2
    pos = (
      (low_x + high_x) / 2,
      (low_y + high_y) / 2,
      ws.FLOOR_Z - half_z,
    )
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
    return self._add_box(f"wall_{index}", pos, size, quat=quat, group=3)

  def _add_visual_wall(self, index: int) -> None:
    """A mitred prism for the eye, where the collision boxes overlap."""
    inner, outer = ws.FLOOR_HALF, ws.TRAY_HALF
    low = ws.FLOOR_Z - ws.SLOT_DEPTH - 2 * _BASE_HALF
    corners = []
    for side in (-1.0, 1.0):
      corners += [
        (inner, side * inner, ws.FLOOR_Z),
        (outer, side * outer, ws.RIM_Z),
        (outer, side * outer, low),
        (inner, side * inner, low),
      ]
    turn = index * math.pi / 2
    cos, sin = math.cos(turn), math.sin(turn)
    centre_x, centre_y = ws.CENTRE_XY
    mesh = self._mjcf_model.asset.add(
      "mesh",
      name=f"wall_{index}",
      vertex=[
        value
        for x, y, z in corners
        for value in (
          centre_x + x * cos - y * sin,
          centre_y + x * sin + y * cos,
          z,
        )
      ],
    )
    self._mjcf_model.worldbody.add(
      "geom",
      type="mesh",
      mesh=mesh,
      material=self._material,
      contype=0,
      conaffinity=0,
      mass=0,
    )

  @property
  def mjcf_model(self) -> mjcf.RootElement:
    """The tray's own MJCF tree."""
    return self._mjcf_model

  @property
  def floor_geoms(self) -> list:
    """The floor's geoms and the slab under the pockets."""
    return self._floor_geoms

  @property
  def wall_geoms(self) -> list:
    """The four sloped walls."""
    return self._wall_geoms

  @property
  def geoms(self) -> list:
    """Everything a block can touch."""
    return self._floor_geoms + self._wall_geoms


def _floor_boxes():
  """Boxes (name, x range, y range) that tile the floor around two pockets."""
  low_x, high_x = -ws.FLOOR_HALF, ws.FLOOR_HALF
  low_y = ws.CENTRE_XY[1] - ws.FLOOR_HALF
  high_y = ws.CENTRE_XY[1] + ws.FLOOR_HALF
  boxes = []
  edge = low_x
  for name, (x, y) in (("green", ws.GREEN_XY), ("blue", ws.BLUE_XY)):
    left, right = x - ws.SLOT_HALF, x + ws.SLOT_HALF
    near, far = y - ws.SLOT_HALF, y + ws.SLOT_HALF
    boxes.append((f"floor_left_of_{name}", (edge, left), (low_y, high_y)))
    boxes.append((f"floor_near_{name}", (left, right), (low_y, near)))
    boxes.append((f"floor_far_{name}", (left, right), (far, high_y)))
    edge = right
  boxes.append(("floor_right", (edge, high_x), (low_y, high_y)))
  return boxes
