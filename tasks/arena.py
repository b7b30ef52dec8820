"""The room around the robot: table, light, sky and cameras."""

from dm_control import composer

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.rotations import look_at

_PHYSICS_STEP = 0.005  # s
_TABLE_HALF = (0.5, 0.75)  # m
_TABLE_TOP_HALF = 0.015  # m
_TABLE_CENTRE_Y = 0.45  # m

FRONT_CAMERA = "front"
# Name, eye, target (m), vertical field of view (degrees).
_CAMERAS = (
  (FRONT_CAMERA, (0.0, 1.02, 0.55), (0.0, 0.47, 0.15), 42),
  ("three_quarter", (0.80, 1.12, 0.66), (0.0, 0.37, 0.25), 35),
)
# Name, position (m), direction, diffuse and specular colour, casts a shadow.
_LIGHTS = (
  ("key", (0.75, 1.75, 1.9), (-0.4, -0.72, -1), (0.6, 0.59, 0.57), 0.2, True),
  ("fill", (-0.9, 0.9, 1.2), (0.6, -0.3, -0.8), (0.22, 0.23, 0.26), 0, False),
)


class PlayArena(composer.Arena):
  """A table, where a block that left the tray comes to rest.

  The robot's base stands at the origin.
  """

  def _build(self, name: str = "play") -> None:
    super()._build(name)
    root = self.mjcf_model
    self._set_physics(root)
    self._set_look(root)
    self.table = root.worldbody.add(
      "geom",
      name="table",
      type="box",
      pos=(0, _TABLE_CENTRE_Y, ws.TABLE_Z - _TABLE_TOP_HALF),
      size=(*_TABLE_HALF, _TABLE_TOP_HALF),
      material=root.asset.add(
        "material", name="wood", rgba=(0.50, 0.48, 0.46, 1), specular=0.05
      ),
      contype=0,
      conaffinity=0,
    )
    for name, eye, target, fovy in _CAMERAS:
      root.worldbody.add(
        "camera", name=name, pos=eye, xyaxes=look_at(eye, target), fovy=fovy
      )

  def _set_physics(self, root) -> None:
    # Fewer line-search iterations let blocks fly off, and pyramidal cones let a
    # grasp slip. So do the implicit integrators (5 mm in 10 s of moves, not
    # 1 mm): they solve contact forces before the servos' damping, and hand and
    # block part a little at each start.
    root.option.timestep = _PHYSICS_STEP
    root.option.gravity = (0, 0, -9.81)  # m/s^2
    root.option.integrator = "Euler"
    root.option.solver = "Newton"
    root.option.cone = "elliptic"
    root.option.impratio = 5
    root.option.iterations = 100
    root.option.ls_iterations = 50
    root.option.tolerance = 1e-8

  def _set_look(self, root) -> None:
    root.visual.headlight.set_attributes(
      ambient=(0.36, 0.36, 0.38), diffuse=(0.25, 0.25, 0.25), specular=(0, 0, 0)
    )
    root.visual.quality.shadowsize = 2048
    root.visual.quality.offsamples = 4
    root.visual.map.znear = 0.02
    getattr(root.visual, "global").set_attributes(offwidth=1280, offheight=960)
    root.asset.add(
      "texture",
      type="skybox",
      builtin="gradient",
      rgb1=(0.93, 0.95, 0.97),
      rgb2=(0.70, 0.76, 0.84),
      width=256,
      height=256,
    )
    for name, pos, direction, diffuse, specular, castshadow in _LIGHTS:
      root.worldbody.add(
        "light",
        name=name,
        pos=pos,
        dir=direction,
        diffuse=diffuse,
        specular=[specular] * 3,
        castshadow=castshadow,
        directional=False,
      )
