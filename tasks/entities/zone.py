"""A coloured square on the tray that lights up when its block is in it."""

from dm_control import composer, mjcf
from dm_control.composer.observation import observable

from lfgp_dmc.tasks import workspace

_THICKNESS = 0.0002  # m; visual only, just above the floor
_DIM = 0.45  # share of the colour while empty
_LIT_EMISSION = 0.6


class Zone(composer.Entity):
  """A visual frame of four strips around a slot; it touches nothing."""

  def _build(self, name: str, xy, rgba) -> None:
    self._mjcf_model = mjcf.RootElement(model=name)
    self._lit = False
    self._rgba = rgba
    dim = (*(_DIM * c + (1 - _DIM) * 0.8 for c in rgba[:3]), 1.0)
    self._colours = {True: rgba, False: dim}
    self._material = self._mjcf_model.asset.add(
      "material", name="paint", rgba=dim, emission=0.0
    )
    for index, (pos, size) in enumerate(_strips(xy)):
      self._mjcf_model.worldbody.add(
        "geom",
        name=f"strip_{index}",
        type="box",
        pos=pos,
        size=size,
        material=self._material,
        contype=0,
        conaffinity=0,
        mass=0,
      )

  def _build_observables(self) -> "ZoneObservables":
    return ZoneObservables(self)

  @property
  def mjcf_model(self) -> mjcf.RootElement:
    """The zone's own MJCF tree."""
    return self._mjcf_model

  @property
  def lit(self) -> bool:
    """Is its block in it."""
    return self._lit

  def light(self, physics, lit: bool) -> None:
    """Lights the zone up, or dims it; cheap when nothing changes."""
    if lit != self._lit:
      self._lit = lit
      material = physics.bind(self._material)
      material.rgba = self._colours[lit]
      material.emission = _LIT_EMISSION if lit else 0.0


class ZoneObservables(composer.Observables):
  """Whether the zone's block is in it."""

  @composer.observable
  def is_lit(self):
    """Bool []."""
    return observable.Generic(lambda physics: self._entity.lit)


def _strips(xy):
  """Position and half size of the strips that leave the pocket open."""
  outer, inner = workspace.ZONE_HALF, workspace.SLOT_HALF
  wide, offset = (outer - inner) / 2, (outer + inner) / 2
  z, half = workspace.FLOOR_Z, _THICKNESS
  x, y = xy
  return [
    ((x - offset, y, z), (wide, outer, half)),
    ((x + offset, y, z), (wide, outer, half)),
    ((x, y - offset, z), (inner, wide, half)),
    ((x, y + offset, z), (inner, wide, half)),
  ]
