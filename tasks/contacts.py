"""The contact pairs and their friction; no other geoms collide.

MuJoCo would combine two geoms' frictions by their maximum; the released
environment's simulator multiplies them, so every pair states its own.
"""

import itertools

from lfgp_dmc.tasks.arena import PlayArena
from lfgp_dmc.tasks.entities import Block, Panda, Tray

# Sliding friction coefficients: products of the released environment's.
_BLOCK_TRAY = 0.42
_BLOCK_FINGER = 0.7
_BLOCK_BLOCK = 0.49
_FINGER_TRAY = 0.6
_TORSION = 0.01  # m
_ROLL = 0.0001  # m

_SOLREF = (0.01, 1.0)  # s, damping ratio
_SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)


def add_pairs(
  arena: PlayArena, panda: Panda, blue: Block, green: Block, tray: Tray
) -> None:
  """Declares every contact pair of the play world on the arena."""
  fingers, blocks = panda.pads_and_fingers, [blue.geom, green.geom]
  for some, others, friction, dimensions in (
    ([blue.geom], [green.geom], _BLOCK_BLOCK, 3),
    (blocks, [*tray.geoms, arena.table], _BLOCK_TRAY, 3),
    (blocks, [*fingers, panda.hand_geom], _BLOCK_FINGER, 4),
    (fingers, tray.wall_geoms, _FINGER_TRAY, 3),
  ):
    for first, second in itertools.product(some, others):
      arena.mjcf_model.contact.add(
        "pair",
        geom1=first,
        geom2=second,
        condim=dimensions,
        friction=(friction, friction, _TORSION, _ROLL, _ROLL),
        solref=_SOLREF,
        solimp=_SOLIMP,
      )
