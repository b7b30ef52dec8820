"""A Franka Panda with its hand: arm, fingers, TCP site and wrist sensor."""

import pathlib

import rtbdata
from dm_control import composer, mjcf
from dm_control.composer.observation import observable

from lfgp_dmc.tasks.entities import panda_links as links

_MESHES = pathlib.Path(rtbdata.__file__).parent / "meshes/FRANKA-EMIKA/Panda"
_WHITE = (0.93, 0.93, 0.94, 1.0)
_DARK = (0.22, 0.23, 0.25, 1.0)

_JOINT_DAMPING = 0.3  # N m s/rad
# Reflected rotor inertia, kg m^2; large enough for explicit damping.
_JOINT_ARMATURES = (0.15, 0.15, 0.15, 0.3, 0.3, 0.4, 0.3)
_NULL_SPACE_STIFFNESS = 0.5  # N m/rad, pulls the elbow home
_FINGER_ARMATURE = 0.2  # kg
_FINGER_COUPLING = (0.01, 1.0)  # solref: s, damping ratio

# Pads: full size 17 x 10 x 18.4 mm, inner face in the plane where the fingers
# meet, end 7 mm past the TCP; the finger's thicker body above them.
_PAD_HALF = (0.0085, 0.005, 0.0092)  # m
_PAD_POS = (0.0, 0.005, 0.0444)  # m
_BODY_HALF = (0.0095, 0.0085, 0.0175)  # m
_BODY_POS = (0.0, 0.0145, 0.0175)  # m
_HAND_HALF = (0.03, 0.1, 0.033)  # m
_HAND_POS = (0.0, 0.0, 0.033)  # m

_NO_CONTACT = {"contype": 0, "conaffinity": 0}


class Panda(composer.Entity):
  """The arm and hand; how it is driven is `tasks/control.py`'s business."""

  def _build(self, name: str = "panda") -> None:
    self._mjcf_model = mjcf.RootElement(model=name)
    asset = self._mjcf_model.asset
    self._materials = {
      "white": asset.add(
        "material", name="white", rgba=_WHITE, specular=0.4, shininess=0.5
      ),
      "dark": asset.add(
        "material", name="dark", rgba=_DARK, specular=0.3, shininess=0.3
      ),
    }
    self._joints: list = []
    self._collision_geoms: list = []
    flange = self._add_arm()
    self._hand = self._add_hand(flange)
    self._fingers = [
      self._add_finger("left", (1.0, 0.0, 0.0, 0.0)),
      self._add_finger("right", (0.0, 0.0, 0.0, 1.0)),
    ]
    self._finger_joints = [finger.joint[0] for finger in self._fingers]
    self._mjcf_model.equality.add(
      "joint",
      name="finger_coupling",
      joint1=self._finger_joints[0],
      joint2=self._finger_joints[1],
      solref=_FINGER_COUPLING,
    )
    self._add_sites_and_sensors()

  def _add_mesh(self, body, name: str, material: str, **options) -> None:
    mesh = self._mjcf_model.find("mesh", name)
    if mesh is None:
      mesh = self._mjcf_model.asset.add(
        "mesh", name=name, file=str(_MESHES / f"{name}.stl")
      )
    body.add(
      "geom",
      type="mesh",
      mesh=mesh,
      material=self._materials[material],
      group=2,
      mass=0,
      **_NO_CONTACT,
      **options,
    )

  def _add_arm(self):
    body = self._mjcf_model.worldbody
    for link in links.ARM_LINKS:
      body = body.add(
        "body", name=link.name, pos=link.pos, quat=link.quat, gravcomp=1
      )
      body.add(
        "inertial",
        pos=link.centre_of_mass,
        mass=link.mass,
        fullinertia=link.inertia,
      )
      if link.joint_range is not None:
        index = len(self._joints)
        self._joints.append(
          body.add(
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
        )
      self._add_mesh(body, link.name, "white")
      for start, end, radius in link.capsules:
        self._collision_geoms.append(
          body.add(
            "geom",
            type="capsule",
            fromto=(*start, *end),
            size=(radius,),
            group=3,
            **_NO_CONTACT,
          )
        )
    return body

  def _add_box(self, body, name, pos, half):
    geom = body.add(
      "geom",
      name=name,
      type="box",
      pos=pos,
      size=half,
      group=3,
      mass=0,
      **_NO_CONTACT,
    )
    self._collision_geoms.append(geom)
    return geom

  def _add_hand(self, flange):
    hand = flange.add(
      "body",
      name="hand",
      pos=links.HAND_POS,
      quat=links.HAND_QUAT,
      gravcomp=1,
    )
    hand.add(
      "inertial",
      pos=links.HAND_CENTRE_OF_MASS,
      mass=links.HAND_MASS,
      diaginertia=links.HAND_INERTIA,
    )
    self._add_mesh(hand, "hand", "white")
    self._hand_geom = self._add_box(hand, "hand", _HAND_POS, _HAND_HALF)
    return hand

  def _add_finger(self, side: str, quat):
    finger = self._hand.add(
      "body",
      name=f"{side}_finger",
      pos=(0, 0, links.FINGER_Z),
      quat=quat,
      gravcomp=1,
    )
    half_y = _PAD_HALF[1]
    finger.add(
      "inertial",
      pos=(0, half_y, 0.03),
      mass=links.FINGER_MASS,
      diaginertia=(4e-5, 4e-5, 1e-5),
    )
    finger.add(
      "joint",
      name=f"{side}_finger",
      type="slide",
      axis=(0, 1, 0),
      range=(0, links.FINGER_TRAVEL),
      limited=True,
      armature=_FINGER_ARMATURE,
    )
    self._add_mesh(finger, "finger", "dark")
    self._add_box(finger, f"{side}_pad", _PAD_POS, _PAD_HALF)
    self._add_box(finger, f"{side}_finger", _BODY_POS, _BODY_HALF)
    return finger

  def _add_sites_and_sensors(self) -> None:
    site = {"type": "sphere", "size": (0.002,), "group": 4}
    self._tcp = self._hand.add(
      "site", name="tcp", pos=(0, 0, links.TCP_Z), **site
    )
    self._wrist = self._hand.add("site", name="wrist", **site)
    sensor = self._mjcf_model.sensor
    tcp = {"objtype": "site", "objname": self._tcp}
    left, right = self._finger_joints
    self._sensors = {
      "tcp_position": sensor.add("framepos", name="tcp_position", **tcp),
      "tcp_velocity": sensor.add("framelinvel", name="tcp_velocity", **tcp),
      "left_finger": sensor.add("jointpos", name="left_finger", joint=left),
      "right_finger": sensor.add("jointpos", name="right_finger", joint=right),
      "force": sensor.add("force", name="force", site=self._wrist),
      "torque": sensor.add("torque", name="torque", site=self._wrist),
    }

  def _build_observables(self) -> "PandaObservables":
    return PandaObservables(self)

  @property
  def mjcf_model(self) -> mjcf.RootElement:
    """The robot's own MJCF tree."""
    return self._mjcf_model

  @property
  def joints(self) -> list:
    """The arm's seven joints, from the base."""
    return self._joints

  @property
  def finger_joints(self) -> list:
    """Left (+y of the hand) and right finger's slides."""
    return self._finger_joints

  @property
  def tcp(self):
    """The tool centre point, a site between the pads."""
    return self._tcp

  @property
  def wrist(self):
    """The site of the force-torque sensor."""
    return self._wrist

  @property
  def sensors(self):
    """Sensor elements by quantity; positions in the world frame."""
    return self._sensors

  @property
  def hanging_bodies(self) -> list:
    """What hangs beyond the wrist sensor: hand and fingers."""
    return [self._hand, *self._fingers]

  @property
  def pads_and_fingers(self) -> list:
    """The boxes of both fingers."""
    return [
      geom
      for finger in self._fingers
      for geom in finger.geom
      if geom.type == "box"
    ]

  @property
  def hand_geom(self):
    """The box around the palm."""
    return self._hand_geom

  @property
  def collision_geoms(self) -> list:
    """Every primitive: arm capsules, palm, fingers."""
    return self._collision_geoms


class PandaObservables(composer.Observables):
  """What the robot's own sensors read."""

  @composer.observable
  def joint_positions(self):
    """The arm's joint angles, float [7], rad."""
    return observable.MJCFFeature("qpos", self._entity.joints)

  @composer.observable
  def joint_velocities(self):
    """The arm's joint velocities, float [7], rad/s."""
    return observable.MJCFFeature("qvel", self._entity.joints)

  @composer.observable
  def tcp_position(self):
    """Tool centre point in the base frame, float [3], m."""
    return observable.MJCFFeature(
      "sensordata", self._entity.sensors["tcp_position"]
    )

  @composer.observable
  def tcp_velocity(self):
    """Tool centre point's velocity, float [3], m/s."""
    return observable.MJCFFeature(
      "sensordata", self._entity.sensors["tcp_velocity"]
    )

  @composer.observable
  def wrist_force(self):
    """Raw wrist force in the hand's frame, float [3], N."""
    return observable.MJCFFeature("sensordata", self._entity.sensors["force"])

  @composer.observable
  def wrist_torque(self):
    """Raw wrist torque in the hand's frame, float [3], N m."""
    return observable.MJCFFeature("sensordata", self._entity.sensors["torque"])
