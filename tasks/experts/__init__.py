"""Scripted experts for the nine tasks, acting on the 59 floats alone."""

from lfgp_dmc.tasks.experts.expert import NOISE, POLICIES, ScriptedExpert


def make_expert(noise: float = NOISE, control_hz: int = 20) -> ScriptedExpert:
  """Makes the scripted expert; importable and picklable for workers.

  Args:
    noise: standard deviation of the Gaussian action noise.
    control_hz: control steps a second of the environment.

  Returns:
    An `lfgp_dmc.types.Actor` for all nine tasks.
  """
  return ScriptedExpert(noise, control_hz)


__all__ = ["NOISE", "POLICIES", "ScriptedExpert", "make_expert"]
