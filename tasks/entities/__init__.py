"""The bodies of the play world, one entity a file."""

from lfgp_dmc.tasks.entities.block import Block
from lfgp_dmc.tasks.entities.panda import Panda
from lfgp_dmc.tasks.entities.tray import Tray
from lfgp_dmc.tasks.entities.zone import Zone

__all__ = ["Block", "Panda", "Tray", "Zone"]
