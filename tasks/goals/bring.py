"""Bring and Insert: blue is let go close to, or in, its slot."""

import math

from lfgp_dmc.tasks import predicates
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.goals import terms
from lfgp_dmc.tasks.goals.goal import Goal, Terms
from lfgp_dmc.tasks.snapshot import Snapshot

BRING_RADIUS = 0.03  # m, to p_s
INSERT_RADIUS = 0.0025  # m, to p_s: reached by an inserted block alone
_DONE = 0.02  # m, of the dense rewards' bonus for letting go
_BRING_GOAL = (*ws.BLUE_XY, ws.FLAT_Z)


def is_brought(state: Snapshot) -> bool:
  """Blue lies within 3 cm of p_s, let go."""
  return (
    predicates.is_released_on_tray(state)
    and math.dist(state.blue, ws.BLUE_SLOT) < BRING_RADIUS
  )


def is_inserted(state: Snapshot) -> bool:
  """Blue sits within 2.5 mm of p_s, let go."""
  return (
    predicates.is_released_on_tray(state)
    and math.dist(state.blue, ws.BLUE_SLOT) < INSERT_RADIUS
  )


def bring_terms(state: Snapshot) -> Terms:
  """Closeness to a flat block's place in the zone (goal at z 0.145)."""
  return _terms(state, _BRING_GOAL, 0.02)


def insert_terms(state: Snapshot) -> Terms:
  """Closeness to p_s."""
  return _terms(state, ws.BLUE_SLOT, 0.001)


def _terms(state: Snapshot, goal, threshold: float) -> Terms:
  is_near = predicates.distance(state) <= predicates.NEAR
  is_done = math.dist(state.blue, goal) < _DONE
  is_opening = state.action[3] < 0.0
  return {
    "goal": terms.closeness(threshold, state.blue, goal) if is_near else 0.0,
    "retreat": 0.3 * terms.retreat(state) if is_done and is_opening else 0.0,
  }


BRING = Goal("bring", is_brought, bring_terms)
INSERT = Goal("insert", is_inserted, insert_terms)
