"""The base of the play world's entities."""

from dm_control import composer, mjcf


class Body(composer.Entity):
  """An entity whose only contacts are the pairs of `contacts.py`."""

  mjcf_model: mjcf.RootElement = None  # abstract in Composer

  def _start_model(self, name: str) -> mjcf.RootElement:
    self.mjcf_model = mjcf.RootElement(model=name)
    self.mjcf_model.default.geom.set_attributes(contype=0, conaffinity=0)
    return self.mjcf_model
