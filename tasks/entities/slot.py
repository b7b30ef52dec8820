"""The place of an inserted block: the target pose p_s of the paper."""

from dm_control import composer, mjcf
from dm_control.composer.observation import observable

from lfgp_dmc.tasks import workspace


class Slot(composer.Entity):
  """A site at the centre of a block that sits in a pocket of the tray.

  The pocket's walls belong to the tray; the slot only names the target.
  """

  def _build(self, name: str, xy: tuple[float, float]) -> None:
    self._mjcf_model = mjcf.RootElement(model=name)
    self._target = self._mjcf_model.worldbody.add(
      "site",
      name="target",
      type="sphere",
      size=(0.002,),
      pos=(*xy, workspace.INSERTED_Z),
      group=4,
    )

  def _build_observables(self) -> "SlotObservables":
    return SlotObservables(self)

  @property
  def mjcf_model(self) -> mjcf.RootElement:
    """The slot's own MJCF tree."""
    return self._mjcf_model

  @property
  def target(self):
    """The site at p_s."""
    return self._target


class SlotObservables(composer.Observables):
  """Where an inserted block's centre is."""

  @composer.observable
  def target_position(self):
    """p_s, float [3], m."""
    return observable.MJCFFeature("xpos", self._entity.target)
