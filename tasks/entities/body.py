"""What the play world's bodies have in common."""

from dm_control import composer, mjcf


class Body(composer.Entity):
  """An entity whose geoms touch nothing but what `contacts.py` pairs them with.

  Attributes:
    mjcf_model: its own MJCF tree.
  """

  mjcf_model: mjcf.RootElement = None  # Composer wants the name in the class

  def _start_model(self, name: str) -> mjcf.RootElement:
    self.mjcf_model = mjcf.RootElement(model=name)
    self.mjcf_model.default.geom.set_attributes(contype=0, conaffinity=0)
    return self.mjcf_model
