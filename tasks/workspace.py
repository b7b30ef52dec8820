"""The named numbers of the play world, in the robot's base frame.

+y points away from the robot, z up. Source: the released environment, with
its slips mended (see "Departures" in WORKSPACE.md). Lengths in m.
"""

import math

CENTRE_XY = (0.0, 0.5)  # centre of the tray and of the set-point box
FLOOR_Z = 0.125  # top of the tray's flat floor
FLOOR_HALF = 0.15  # half side of the flat floor
TRAY_HALF = 0.24  # half side of the tray, slopes included
RIM_Z = 0.170  # top of the slopes
SLOPE_ANGLE = math.atan2(RIM_Z - FLOOR_Z, TRAY_HALF - FLOOR_HALF)  # rad
TABLE_Z = 0.105  # top of the table under the tray

BLOCK_HALF = 0.02  # half side of a block
FLAT_Z = 0.145  # centre of a block flat on the floor
INSERTED_Z = 0.135  # centre of a block pushed into its slot
STACKED_Z = 0.185  # centre of a block on top of a flat one

SLOT_HALF = 0.0205  # half side of the square pockets
SLOT_DEPTH = 0.01
ZONE_HALF = 0.04  # half side of the coloured zones
BLUE_XY = (0.075, 0.5)  # centre of blue's zone and slot
GREEN_XY = (-0.075, 0.5)  # centre of green's zone and slot
BLUE_SLOT = (*BLUE_XY, INSERTED_Z)  # p_s of the paper, for blue
GREEN_SLOT = (*GREEN_XY, INSERTED_Z)  # p_s of the paper, for green

# The TCP's set-point is clipped to this box: 30 x 30 x 14.5 cm.
SET_POINT_LOW = (-0.15, 0.35, 0.145)
SET_POINT_HIGH = (0.15, 0.65, 0.29)
SET_POINT_SPEED = 0.2  # m/s at |a| = 1: 1 cm per 50 ms

# Start states: spawn="published" samples in the central 15 x 15 cm.
SPAWN_HALF = 0.075
START_CLEARANCE = 0.0005  # of a block above what it is set on
TCP_START_Z = (FLOOR_Z + 0.05, FLOOR_Z + 0.145)

BLUE_RGBA = (0.13, 0.34, 0.80, 1.0)
GREEN_RGBA = (0.20, 0.66, 0.30, 1.0)

CHECK_PERIOD = 0.05  # s between two checks of a success condition
