"""The Franka Panda's kinematics and inertias, as data.

Frames and joint limits follow Franka's published figures (the DH table and
limits of its interface documentation); masses and inertias its published
dynamic parameters, identified on the real arm (Gaz et al., 2019). Lengths in
m, angles in rad, masses in kg, inertias in kg m^2.
"""

from typing import NamedTuple


class Link(NamedTuple):
  """A link, in its parent link's frame, and the joint that carries it."""

  name: str
  pos: tuple[float, float, float]
  quat: tuple[float, float, float, float]  # w x y z, normalised by MuJoCo
  joint_range: tuple[float, float] | None  # None: welded to its parent
  mass: float
  centre_of_mass: tuple[float, float, float]
  inertia: tuple[float, float, float, float, float, float]  # xx yy zz xy xz yz
  # Collision capsules: (from, to, radius), in the link's frame.
  capsules: tuple[tuple[tuple, tuple, float], ...]


_UP = (1.0, 0.0, 0.0, 0.0)
_BACK = (1.0, -1.0, 0.0, 0.0)  # -90 degrees about x
_FORTH = (1.0, 1.0, 0.0, 0.0)  # +90 degrees about x

ARM_LINKS = (
  Link(
    "link0",
    (0.0, 0.0, 0.0),
    _UP,
    None,
    0.629769,
    (-0.041018, -0.00014, 0.049974),
    (0.00315, 0.00388, 0.004285, 8.29e-07, 0.00015, 8.23e-06),
    (((-0.075, 0.0, 0.06), (0.0, 0.0, 0.06), 0.06),),
  ),
  Link(
    "link1",
    (0.0, 0.0, 0.333),
    _UP,
    (-2.8973, 2.8973),
    4.970684,
    (0.003875, 0.002081, -0.04762),
    (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169),
    (((0.0, 0.0, -0.333), (0.0, 0.0, -0.05), 0.06),),
  ),
  Link(
    "link2",
    (0.0, 0.0, 0.0),
    _BACK,
    (-1.7628, 1.7628),
    0.646926,
    (-0.003141, -0.02872, 0.003495),
    (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704),
    (((0.0, 0.0, -0.06), (0.0, 0.0, 0.06), 0.06),),
  ),
  Link(
    "link3",
    (0.0, -0.316, 0.0),
    _FORTH,
    (-2.8973, 2.8973),
    3.228604,
    (0.027518, 0.039252, -0.066502),
    (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805),
    (((0.0, 0.0, -0.22), (0.0, 0.0, -0.07), 0.06),),
  ),
  Link(
    "link4",
    (0.0825, 0.0, 0.0),
    _FORTH,
    (-3.0718, -0.0698),
    3.587895,
    (-0.05317, 0.104419, 0.027454),
    (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641),
    (((0.0, 0.0, -0.05), (0.0, 0.0, 0.06), 0.06),),
  ),
  Link(
    "link5",
    (-0.0825, 0.384, 0.0),
    _BACK,
    (-2.8973, 2.8973),
    1.225946,
    (-0.011953, 0.041065, -0.038437),
    (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229),
    (
      ((0.0, 0.0, -0.26), (0.0, 0.0, -0.2), 0.06),
      ((0.0, 0.08, -0.19), (0.0, 0.08, 0.0), 0.025),
    ),
  ),
  Link(
    "link6",
    (0.0, 0.0, 0.0),
    _FORTH,
    (-0.0175, 3.7525),
    1.666555,
    (0.060149, -0.014117, -0.010517),
    (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341),
    (((0.0, 0.0, -0.06), (0.0, 0.0, 0.01), 0.05),),
  ),
  Link(
    "link7",
    (0.088, 0.0, 0.0),
    _FORTH,
    (-2.8973, 2.8973),
    0.735522,
    (0.010517, -0.004252, 0.061597),
    (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741),
    (((0.0, 0.0, -0.06), (0.0, 0.0, 0.08), 0.045),),
  ),
)

# The hand hangs on the flange, turned by -45 degrees about z.
HAND_POS = (0.0, 0.0, 0.107)
HAND_QUAT = (0.9238795325, 0.0, 0.0, -0.3826834324)
HAND_MASS = 0.73
HAND_CENTRE_OF_MASS = (-0.01, 0.0, 0.03)
HAND_INERTIA = (0.001, 0.0025, 0.0017)  # diagonal

FINGER_Z = 0.0584  # finger joints' height in the hand's frame
FINGER_TRAVEL = 0.04  # each finger, from closed to open
FINGER_MASS = 0.1  # as the released environment's, heavier than the real 15 g
TCP_Z = 0.105  # tool centre point in the hand's frame, 7 mm above the tips

# The arm's start, elbow up and hand down over the tray's centre.
HOME = (1.253, -0.272, 0.417, -2.473, 0.137, 2.219, 2.359)
