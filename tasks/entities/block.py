"""A cube that can be grasped, stacked and inserted."""

from dm_control import composer, mjcf
from dm_control.composer.observation import observable

from lfgp_dmc.tasks import workspace

_MASS = 0.1  # kg


class Block(composer.Entity):
  """A free 4 cm cube of 100 g."""

  def _build(self, name: str, rgba=workspace.BLUE_RGBA) -> None:
    half = workspace.BLOCK_HALF
    self._mjcf_model = mjcf.RootElement(model=name)
    material = self._mjcf_model.asset.add(
      "material", name="paint", rgba=rgba, specular=0.25, shininess=0.4
    )
    self._geom = self._mjcf_model.worldbody.add(
      "geom",
      name="cube",
      type="box",
      size=(half, half, half),
      mass=_MASS,
      material=material,
      contype=0,
      conaffinity=0,
    )
    site = {"type": "sphere", "size": (0.001,), "rgba": (0, 0, 0, 0)}
    self._centre = self._mjcf_model.worldbody.add(
      "site", name="centre", group=4, **site
    )
    sensor = self._mjcf_model.sensor
    target = {"objtype": "site", "objname": self._centre}
    self._sensors = {
      "position": sensor.add("framepos", name="position", **target),
      "rotation": sensor.add("framequat", name="rotation", **target),
      "linear_velocity": sensor.add(
        "framelinvel", name="linear_velocity", **target
      ),
      "angular_velocity": sensor.add(
        "frameangvel", name="angular_velocity", **target
      ),
    }

  def _build_observables(self) -> "BlockObservables":
    return BlockObservables(self)

  @property
  def mjcf_model(self) -> mjcf.RootElement:
    """The block's own MJCF tree."""
    return self._mjcf_model

  @property
  def geom(self):
    """The cube's geom element."""
    return self._geom

  @property
  def sensors(self):
    """Sensor elements by quantity, all in the world frame."""
    return self._sensors


class BlockObservables(composer.Observables):
  """What the simulator knows of one block (privileged), in the base frame."""

  @composer.observable
  def position(self):
    """Centre, float [3], m."""
    return observable.MJCFFeature(
      "sensordata", self._entity.sensors["position"]
    )

  @composer.observable
  def rotation(self):
    """Quaternion w x y z, float [4], as simulated (not symmetry-reduced)."""
    return observable.MJCFFeature(
      "sensordata", self._entity.sensors["rotation"]
    )

  @composer.observable
  def linear_velocity(self):
    """Velocity of the centre, float [3], m/s."""
    return observable.MJCFFeature(
      "sensordata", self._entity.sensors["linear_velocity"]
    )

  @composer.observable
  def angular_velocity(self):
    """Angular velocity, float [3], rad/s."""
    return observable.MJCFFeature(
      "sensordata", self._entity.sensors["angular_velocity"]
    )
