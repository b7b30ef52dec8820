"""The expert of Stack and Unstack-Stack, a function of one observation."""

import math

from lfgp_dmc.tasks.experts import grasp, place
from lfgp_dmc.tasks.experts.motion import CLOSE, OPEN, Command
from lfgp_dmc.tasks.experts.view import View, is_held, is_on

_ABOVE = 0.0405  # m, centre to centre, at which blue is let go
_ALIGNED = 0.006  # m


def stack(view: View) -> Command:
  """Takes green off blue if it is there, then puts blue on green."""
  if freeing := place.free_blue(view):
    return freeing
  blue, green = view.blue, view.green
  if is_held(view, blue):
    error = math.hypot(blue.x - green.x, blue.y - green.y)
    is_down = 0.030 < blue.z - green.z < _ABOVE + 0.0025
    grip = OPEN if error < _ALIGNED and is_down else CLOSE
    spot = (green.x, green.y, green.z + _ABOVE)
    return Command(place.carry(view, blue, spot, narrow=0.003), grip, 0.6)
  if is_on(blue, green):
    return place.leave(view, blue)
  return grasp.grasp(view, blue)
