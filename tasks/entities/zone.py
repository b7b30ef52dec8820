"""A coloured square on the tray that lights up when its block is in it."""

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.entities.body import Body

_THICKNESS = 0.0002  # m; visual only, just above the floor
_DIM = 0.45  # share of the colour while empty
_LIT_EMISSION = 0.6


class Zone(Body):
  """A visual frame of four strips around a slot; it touches nothing."""

  def _build(self, name: str, xy, rgba) -> None:
    root = self._start_model(name)
    self._xy, self.is_lit = xy, False
    dim = (*(_DIM * c + (1 - _DIM) * 0.8 for c in rgba[:3]), 1.0)
    self._colours = {True: rgba, False: dim}
    self._material = root.asset.add(
      "material", name="paint", rgba=dim, emission=0.0
    )
    for index, (pos, size) in enumerate(_strips(xy)):
      root.worldbody.add(
        "geom",
        name=f"strip_{index}",
        type="box",
        pos=pos,
        size=size,
        material=self._material,
        mass=0,
      )

  def light(self, physics, block) -> None:
    """Lights up while `block`, the centre in m, is in the zone; else dims."""
    gap = max(abs(block[0] - self._xy[0]), abs(block[1] - self._xy[1]))
    is_lit = gap < ws.ZONE_HALF and block[2] < ws.FLAT_Z + ws.BLOCK_HALF
    if is_lit != self.is_lit:  # binding takes time
      self.is_lit = is_lit
      material = physics.bind(self._material)
      material.rgba = self._colours[is_lit]
      material.emission = _LIT_EMISSION if is_lit else 0.0


def _strips(xy):
  """Position and half size of the strips that leave the pocket open."""
  outer, inner = ws.ZONE_HALF, ws.SLOT_HALF
  wide, offset = (outer - inner) / 2, (outer + inner) / 2
  z, half = ws.FLOOR_Z, _THICKNESS
  x, y = xy
  return [
    ((x - offset, y, z), (wide, outer, half)),
    ((x + offset, y, z), (wide, outer, half)),
    ((x, y - offset, z), (inner, wide, half)),
    ((x, y + offset, z), (inner, wide, half)),
  ]
