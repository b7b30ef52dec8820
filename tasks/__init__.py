"""The simulator side: entities, control, the nine tasks, scripted experts."""

from tasks.registry import load

__all__ = ["load"]
