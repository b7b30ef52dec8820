"""Scripted experts for the nine tasks, acting on the 59 floats alone."""

from lfgp_dmc.tasks.experts.expert import POLICIES, ScriptedExpert

__all__ = ["POLICIES", "ScriptedExpert"]
