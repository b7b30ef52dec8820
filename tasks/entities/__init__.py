"""The bodies of the play world, one entity a file."""

from tasks.entities.block import Block
from tasks.entities.panda import Panda
from tasks.entities.slot import Slot
from tasks.entities.tray import Tray
from tasks.entities.zone import Zone

__all__ = ["Block", "Panda", "Slot", "Tray", "Zone"]
