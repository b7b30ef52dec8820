"""Everything that is in the play world, put together."""

from lfgp_dmc.tasks import contacts
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.arena import FRONT_CAMERA, PlayArena
from lfgp_dmc.tasks.control import SetPointControl
from lfgp_dmc.tasks.entities import Block, Panda, Tray, Zone
from lfgp_dmc.tasks.features import FeatureReader


class World:
  """Arena, robot, tray, blocks and zones, with contacts, control and a reader.

  The arena is the root entity.
  """

  def __init__(self):
    """Builds and attaches everything; nothing is compiled yet."""
    self.arena = PlayArena()
    self.panda = Panda()
    self.tray = Tray()
    self.blue = Block(name="blue", rgba=ws.BLUE_RGBA)
    self.green = Block(name="green", rgba=ws.GREEN_RGBA)
    self.zones = {
      "blue": Zone(name="blue_zone", xy=ws.BLUE_XY, rgba=ws.BLUE_RGBA),
      "green": Zone(name="green_zone", xy=ws.GREEN_XY, rgba=ws.GREEN_RGBA),
    }
    for entity in (self.panda, self.tray, *self.zones.values()):
      self.arena.attach(entity)
    self.arena.add_free_entity(self.blue)
    self.arena.add_free_entity(self.green)
    front = self.arena.mjcf_model.find("camera", FRONT_CAMERA)
    self.cameras = {FRONT_CAMERA: front, "wrist": self.panda.camera}
    contacts.add_pairs(self.arena, self.panda, self.blue, self.green, self.tray)
    self.control = SetPointControl(self.arena.mjcf_model, self.panda)
    self.reader = FeatureReader(self.panda, self.blue, self.green, self.tray)
