"""A cube that can be grasped, stacked and inserted."""

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.entities.body import Body

_MASS = 0.1  # kg
_SENSORS = {
  "position": "framepos",
  "rotation": "framequat",
  "linear_velocity": "framelinvel",
  "angular_velocity": "frameangvel",
}


class Block(Body):
  """A free 4 cm cube of 100 g; its sensors are in the world frame."""

  def _build(self, name: str, rgba) -> None:
    root = self._start_model(name)
    self.geom = root.worldbody.add(
      "geom",
      name="cube",
      type="box",
      size=[ws.BLOCK_HALF] * 3,
      mass=_MASS,
      material=root.asset.add(
        "material", name="paint", rgba=rgba, specular=0.25, shininess=0.4
      ),
    )
    centre = root.worldbody.add(
      "site",
      name="centre",
      group=4,
      type="sphere",
      size=(0.001,),
      rgba=(0, 0, 0, 0),
    )
    self.sensors = {
      quantity: root.sensor.add(
        kind, name=quantity, objtype="site", objname=centre
      )
      for quantity, kind in _SENSORS.items()
    }
