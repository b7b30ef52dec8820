"""The simulator side: entities, control, the nine tasks, scripted experts."""

from lfgp_dmc.tasks.registry import load

__all__ = ["load"]
