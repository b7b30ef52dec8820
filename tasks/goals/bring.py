"""Bring and Insert: blue is let go close to, or in, its slot."""

import functools
import math

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot


def is_let_go(state: Snapshot, radius: float) -> bool:
  """Blue touches the tray and not the robot, within `radius` of p_s, m."""
  is_near = math.dist(state.blue, ws.BLUE_SLOT) < radius
  return state.blue_on_tray and not state.blue_on_robot and is_near


def dense_terms(state: Snapshot, goal, threshold: float) -> Terms:
  """Closeness of blue to `goal`, full within the threshold, m; then retreat."""
  is_near = state.distance <= terms.NEAR
  is_done = math.dist(state.blue, goal) < 0.02  # m
  is_opening = state.action[3] < 0.0
  return {
    "goal": terms.closeness(threshold, state.blue, goal) if is_near else 0.0,
    "retreat": 0.3 * terms.retreat(state) if is_done and is_opening else 0.0,
  }


BRING = Goal(
  "bring",
  functools.partial(is_let_go, radius=0.03),
  functools.partial(dense_terms, goal=(*ws.BLUE_XY, ws.FLAT_Z), threshold=0.02),
)
INSERT = Goal(
  "insert",
  functools.partial(is_let_go, radius=0.0025),  # only an inserted block's
  functools.partial(dense_terms, goal=ws.BLUE_SLOT, threshold=0.001),
)
