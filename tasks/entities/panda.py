"""A Franka Panda with its hand: arm, fingers, TCP site and wrist sensor."""

import pathlib

import rtbdata

from lfgp_dmc.tasks.entities import panda_links as links
from lfgp_dmc.tasks.entities.body import Body
from lfgp_dmc.tasks.rotations import look_at

_MESHES = pathlib.Path(rtbdata.__file__).parent / "meshes/FRANKA-EMIKA/Panda"
_WHITE = {"rgba": (0.93, 0.93, 0.94, 1.0), "specular": 0.4, "shininess": 0.5}
_DARK = {"rgba": (0.22, 0.23, 0.25, 1.0), "specular": 0.3, "shininess": 0.3}

_JOINT_DAMPING = 0.3  # N m s/rad
# Reflected rotor inertia, kg m^2; large enough for explicit damping.
_JOINT_ARMATURES = (0.15, 0.15, 0.15, 0.3, 0.3, 0.4, 0.3)
_NULL_SPACE_STIFFNESS = 0.5  # N m/rad, pulls the elbow home
_FINGER_ARMATURE = 0.2  # kg
_FINGER_COUPLING = (0.01, 1.0)  # solref: s, damping ratio
_FINGER_INERTIA = (4e-5, 4e-5, 1e-5)  # kg m^2, diagonal

# Pads: full size 17 x 10 x 18.4 mm, inner face in the plane where the fingers
# meet, end 7 mm past the TCP; the finger's thicker body above them.
_PAD_HALF = (0.0085, 0.005, 0.0092)  # m
_PAD_POS = (0.0, 0.005, 0.0444)  # m
_BODY_HALF = (0.0095, 0.0085, 0.0175)  # m
_BODY_POS = (0.0, 0.0145, 0.0175)  # m
_HAND_HALF = (0.03, 0.1, 0.033)  # m
_HAND_POS = (0.0, 0.0, 0.033)  # m

# The camera in front of the hand, in the hand's frame: it looks past the
# fingers at where they will be.
_EYE = (0.08, 0.0, 0.04)  # m
_TARGET = (0.02, 0.0, 0.14)  # m
_FIELD_OF_VIEW = 75  # degrees, vertical


class Panda(Body):
  """The arm and hand, without the servos of `tasks/control.py`.

  Attributes:
    joints: the arm's seven, from the base.
    finger_joints: the slides of the left (+y of the hand) and right finger.
    tcp, wrist: sites between the pads, and of the force-torque sensor.
    sensors: sensor elements by quantity; positions in the world frame.
    camera: on the hand, the camera element.
    hanging_bodies: what hangs beyond the wrist sensor: hand and fingers.
    collision_geoms: every primitive: arm capsules, palm, fingers.
  """

  def _build(self, name: str = "panda") -> None:
    root = self._start_model(name)
    self._white = root.asset.add("material", name="white", **_WHITE)
    self._dark = root.asset.add("material", name="dark", **_DARK)
    self.joints: list = []
    self.collision_geoms: list = []
    hand = self._add_hand(self._add_arm())
    left = self._add_finger(hand, "left", (1.0, 0.0, 0.0, 0.0))
    right = self._add_finger(hand, "right", (0.0, 0.0, 0.0, 1.0))
    self.hanging_bodies = [hand, left, right]
    self.pads_and_fingers = self.collision_geoms[-4:]
    self.finger_joints = [left.joint[0], right.joint[0]]
    root.equality.add(
      "joint",
      name="finger_coupling",
      joint1=self.finger_joints[0],
      joint2=self.finger_joints[1],
      solref=_FINGER_COUPLING,
    )
    self._add_sites_and_sensors(hand)

  def _add_body(self, parent, name: str, pos, quat):
    return parent.add("body", name=name, pos=pos, quat=quat, gravcomp=1)

  def _add_mesh(self, body, name: str, material) -> None:
    root = self.mjcf_model
    mesh = root.find("mesh", name) or root.asset.add(
      "mesh", name=name, file=str(_MESHES / f"{name}.stl")
    )
    body.add("geom", type="mesh", mesh=mesh, material=material, group=2, mass=0)

  def _add_shape(self, body, **options):
    geom = body.add("geom", group=3, mass=0, **options)
    self.collision_geoms.append(geom)
    return geom

  def _add_arm(self):
    body = self.mjcf_model.worldbody
    for link in links.ARM_LINKS:
      body = self._add_body(body, link.name, link.pos, link.quat)
      body.add(
        "inertial",
        pos=link.centre_of_mass,
        mass=link.mass,
        fullinertia=link.inertia,
      )
      if link.joint_range is not None:
        index = len(self.joints)
        joint = body.add(
          "joint",
          name=f"joint{index + 1}",
          axis=(0, 0, 1),
          range=link.joint_range,
          limited=True,
          damping=_JOINT_DAMPING,
          armature=_JOINT_ARMATURES[index],
          stiffness=_NULL_SPACE_STIFFNESS,
          springref=links.HOME[index],
        )
        self.joints.append(joint)
      self._add_mesh(body, link.name, self._white)
      for start, end, radius in link.capsules:
        self._add_shape(
          body, type="capsule", fromto=(*start, *end), size=(radius,)
        )
    return body

  def _add_hand(self, flange):
    hand = self._add_body(flange, "hand", links.HAND_POS, links.HAND_QUAT)
    hand.add(
      "inertial",
      pos=links.HAND_CENTRE_OF_MASS,
      mass=links.HAND_MASS,
      diaginertia=links.HAND_INERTIA,
    )
    self._add_mesh(hand, "hand", self._white)
    self.camera = hand.add(
      "camera",
      name="wrist",
      pos=_EYE,
      xyaxes=look_at(_EYE, _TARGET, up=(1.0, 0.0, 0.0)),
      fovy=_FIELD_OF_VIEW,
    )
    self.hand_geom = self._add_shape(
      hand, name="hand", type="box", pos=_HAND_POS, size=_HAND_HALF
    )
    return hand

  def _add_finger(self, hand, side: str, quat):
    name = f"{side}_finger"
    finger = self._add_body(hand, name, (0, 0, links.FINGER_Z), quat)
    finger.add(
      "inertial",
      pos=(0, _PAD_HALF[1], 0.03),
      mass=links.FINGER_MASS,
      diaginertia=_FINGER_INERTIA,
    )
    finger.add(
      "joint",
      name=name,
      type="slide",
      axis=(0, 1, 0),
      range=(0, links.FINGER_TRAVEL),
      limited=True,
      armature=_FINGER_ARMATURE,
    )
    self._add_mesh(finger, "finger", self._dark)
    for part, pos, half in (
      (f"{side}_pad", _PAD_POS, _PAD_HALF),
      (name, _BODY_POS, _BODY_HALF),
    ):
      self._add_shape(finger, name=part, type="box", pos=pos, size=half)
    return finger

  def _add_sites_and_sensors(self, hand) -> None:
    site = {"type": "sphere", "size": (0.002,), "group": 4}
    self.tcp = hand.add("site", name="tcp", pos=(0, 0, links.TCP_Z), **site)
    self.wrist = hand.add("site", name="wrist", **site)
    tcp = {"objtype": "site", "objname": self.tcp}
    left, right = self.finger_joints
    self.sensors = {
      name: self.mjcf_model.sensor.add(kind, name=name, **target)
      for name, kind, target in (
        ("tcp_position", "framepos", tcp),
        ("tcp_velocity", "framelinvel", tcp),
        ("left_finger", "jointpos", {"joint": left}),
        ("right_finger", "jointpos", {"joint": right}),
        ("force", "force", {"site": self.wrist}),
        ("torque", "torque", {"site": self.wrist}),
      )
    }
