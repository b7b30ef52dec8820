"""Who may touch whom, and with what friction: explicit pairs only.

MuJoCo would combine two geoms' frictions by their maximum; the released
environment's simulator multiplies them, so every pair states its own.
"""

import itertools

from lfgp_dmc.tasks.arena import PlayArena
from lfgp_dmc.tasks.entities import Block, Panda, Tray

# Sliding friction coefficients: products of the released environment's.
BLOCK_TRAY = 0.42
BLOCK_FINGER = 0.7
BLOCK_BLOCK = 0.49
FINGER_TRAY = 0.6
_TORSION = 0.01  # m
_ROLL = 0.0001  # m

_SOLREF = (0.01, 1.0)  # s, damping ratio
_SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)


def add_pairs(
  arena: PlayArena, panda: Panda, blue: Block, green: Block, tray: Tray
) -> None:
  """Declares every contact pair of the play world on the arena."""
  gripper = [*panda.pads_and_fingers, panda.hand_geom]
  blocks = [blue.geom, green.geom]

  def add(first, second, friction: float, dimensions: int) -> None:
    arena.mjcf_model.contact.add(
      "pair",
      geom1=first,
      geom2=second,
      condim=dimensions,
      friction=(friction, friction, _TORSION, _ROLL, _ROLL),
      solref=_SOLREF,
      solimp=_SOLIMP,
    )

  add(blue.geom, green.geom, BLOCK_BLOCK, 3)
  for block, geom in itertools.product(blocks, [*tray.geoms, arena.table]):
    add(block, geom, BLOCK_TRAY, 3)
  for block, geom in itertools.product(blocks, gripper):
    add(block, geom, BLOCK_FINGER, 4)
  for finger, wall in itertools.product(
    panda.pads_and_fingers, tray.wall_geoms
  ):
    add(finger, wall, FINGER_TRAY, 3)
