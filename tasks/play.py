"""The play task: one world, nine goals, the main one chosen by name."""

import functools
import math
import operator

import numpy as np
from dm_control import composer
from dm_control.composer.observation import observable
from dm_env import specs

from lfgp_dmc.observations import (
  CONDITION_PREFIX,
  OBSERVATION_SLICES,
  SUCCESS_PREFIX,
  components,
)
from lfgp_dmc.task_names import MAIN_TASKS
from lfgp_dmc.tasks import control, initialisers
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.arena import FRONT_CAMERA, PlayArena
from lfgp_dmc.tasks.goals import GOALS, terms
from lfgp_dmc.tasks.holds import Holds
from lfgp_dmc.tasks.world import World

REWARDS = ("sparse", "dense")
OBSERVATIONS = ("features", "vision")
REWARD_PREFIX = "reward/"
CAMERA_OBSERVABLE = "camera/front"

_PHYSICS_STEP = 0.005  # s
_SETTLE_STEPS = 100
_MOST_ATTEMPTS = 200
_NO_ACTION = np.zeros(control.ACTION_SIZE)
_FLAGS = (np.array(False), np.array(True))
for _flag in _FLAGS:
  _flag.flags.writeable = False  # handed out as they are


class _Published(observable.Generic):
  """Shows one entry of the dictionary that the task fills once a step."""

  def __init__(self, published: dict[str, np.ndarray], name: str):
    self._read = functools.partial(operator.getitem, published, name)
    super().__init__(lambda physics: self._read())

  def _callable(self, physics):
    return self._read  # no Python between a caller and the entry


class PlayTask(composer.Task):
  """Blocks in a tray, a Panda over it; every task's success is observed.

  Attributes:
    main_task: the task's name.
    world: the entities, the control and the reader.
    blocks_out: how often a block left the tray, over all episodes.
  """

  def __init__(
    self,
    main_task: str,
    reward: str = "sparse",
    observations: str = "features",
    spawn: str = "published",
    control_hz: int = 20,
  ):
    """Builds the world; the arguments are those of `lfgp_dmc.load`."""
    self.main_task = main_task
    self._reward, self._spawn = reward, spawn
    self.world = World()
    self._holds = Holds(GOALS)
    self._requested: initialisers.Start | None = None
    self._action = _NO_ACTION
    self.blocks_out = 0
    self.set_timesteps(
      control_timestep=1.0 / control_hz, physics_timestep=_PHYSICS_STEP
    )
    self._published: dict[str, np.ndarray] = {}
    self._success_names = [SUCCESS_PREFIX + name for name in GOALS]
    self._condition_names = [CONDITION_PREFIX + name for name in GOALS]
    self._task_observables = self._make_observables(observations)

  # What the task is made of.

  @property
  def root_entity(self) -> PlayArena:
    """The arena that everything is attached to."""
    return self.world.arena

  @property
  def task_observables(self) -> dict:
    """The eleven components, successes, conditions and rewards."""
    return self._task_observables

  # Observations.

  def _make_observables(self, observations: str) -> dict:
    made: dict[str, observable.Observable] = {}
    vision = observations == "vision"
    for name, component in OBSERVATION_SLICES.items():
      made[name] = _Published(self._published, name)
      made[name].enabled = not (vision and component.privileged)
    for name in (*self._success_names, *self._condition_names):
      made[name] = _Published(self._published, name)
      made[name].enabled = True
    for name in GOALS:
      read_reward = functools.partial(self._read_reward, name)
      made[REWARD_PREFIX + name] = observable.Generic(read_reward)
    camera = self.world.arena.mjcf_model.find("camera", FRONT_CAMERA)
    made[CAMERA_OBSERVABLE] = observable.MJCFCamera(
      camera, height=84, width=84, update_interval=1
    )
    made[CAMERA_OBSERVABLE].enabled = vision
    return made

  def _publish(self, physics) -> None:
    """Takes the 59 floats once, for every observable to show its part."""
    self._published.update(components(self.world.reader.features(physics)))
    self._publish_flags()

  def _publish_flags(self) -> None:
    successes = map(_FLAGS.__getitem__, self._holds.successes)
    self._published.update(zip(self._success_names, successes, strict=True))
    conditions = map(_FLAGS.__getitem__, self._conditions)
    self._published.update(zip(self._condition_names, conditions, strict=True))

  def _read_reward(self, name: str, physics) -> np.ndarray:
    return np.array(sum(self.reward_terms(name).values()))

  # An episode.

  def initialize_episode_mjcf(self, random_state) -> None:
    """Nothing of the model changes between episodes."""

  def after_compile(self, physics, random_state) -> None:
    """Resolves addresses, with the arm at home."""
    physics.bind(self.world.panda.joints).qpos = initialisers.HOME
    physics.forward()
    self.world.control.after_compile(physics)
    self.world.reader.after_compile(physics)
    self._observe(physics, moved=False)

  def request_start(self, start: initialisers.Start) -> None:
    """Makes the next reset start as asked."""
    self._requested = start

  def initialize_episode(self, physics, random_state) -> None:
    """Samples a start until it is a fair one; see `_is_fair`.

    Raises:
      EpisodeInitializationError: no fair start in many attempts.
    """
    start = self._requested or initialisers.Start()
    free = self._requested is None
    self._requested = None
    for _ in range(_MOST_ATTEMPTS):
      self._place(physics, random_state, start)
      if free:
        for _ in range(_SETTLE_STEPS):
          physics.step()
      self._action = _NO_ACTION
      physics.data.time = 0.0
      self._begin(physics)
      if not free or self._is_fair(physics):
        return
      physics.reset()
    raise composer.EpisodeInitializationError(
      f"no fair start of {self.main_task} in {_MOST_ATTEMPTS} attempts"
    )

  def _place(self, physics, random_state, start: initialisers.Start) -> None:
    tcp = start.tcp
    if tcp is None:
      tcp = initialisers.sample_tcp(random_state, self._spawn)
    fingers = 1.0 if start.fingers is None else start.fingers
    on_blue = self.main_task == "unstack_stack"
    blue, green = initialisers.sample_blocks(
      random_state, self._spawn, on_blue, start
    )
    for block, pose in ((self.world.blue, blue), (self.world.green, green)):
      block.set_pose(physics, position=pose[:3], quaternion=pose[3:])
      block.set_velocity(physics, np.zeros(3), np.zeros(3))
    initialisers.place_arm(physics, self.world.panda, tcp, fingers)
    physics.forward()
    self.world.control.reset(physics, fingers)

  def _begin(self, physics) -> None:
    physics.forward()
    fingers = np.array(physics.bind(self.world.panda.finger_joints).qpos)
    self.world.reader.reset_history(fingers / initialisers.FINGER_TRAVEL)
    self._holds.clear()
    self._is_out = [False, False]
    self._observe(physics, moved=False)
    self._light_zones(physics)

  def _is_fair(self, physics) -> bool:
    """No main task is done, and nothing is wedged, toppled or lost."""
    if any(self.condition(name) for name in MAIN_TASKS):
      return False
    if self.world.reader.robot_touches_block(physics):
      return False
    blue_z, green_z = self._snapshot.blue[2], self._snapshot.green[2]
    if self.main_task == "unstack_stack":
      return abs(green_z - blue_z - 2 * ws.BLOCK_HALF) < 0.001
    return max(blue_z, green_z) < ws.FLAT_Z + 0.005

  # A step.

  def before_step(self, physics, action, random_state) -> None:
    """Clips the action and hands it to the control.

    Raises:
      ValueError: the action has a wrong shape or holds NaN.
    """
    self._action = control.check_action(action)
    self.world.control.apply(physics, self._action)

  def check(self, physics) -> None:
    """One 50 ms check of every condition."""
    self._look(physics, moved=True)
    self._holds.check(self._conditions)

  def after_step(self, physics, random_state) -> None:
    """Takes the 59 floats once, for every observable to slice."""
    self._publish(physics)
    self._count_blocks_out()
    self._light_zones(physics)

  def _light_zones(self, physics) -> None:
    for zone, xy, block in (
      (self.world.zones["blue"], ws.BLUE_XY, self._snapshot.blue),
      (self.world.zones["green"], ws.GREEN_XY, self._snapshot.green),
    ):
      zone.light(physics, _is_in_zone(block, xy))

  def _observe(self, physics, moved: bool) -> None:
    self._look(physics, moved)
    self._publish(physics)

  def _look(self, physics, moved: bool) -> None:
    self._snapshot = self.world.reader.snapshot(physics, self._action, moved)
    self._conditions = [
      goal.condition(self._snapshot) for goal in GOALS.values()
    ]

  def _count_blocks_out(self) -> None:
    positions = (self._snapshot.blue, self._snapshot.green)
    for index, position in enumerate(positions):
      is_out = _is_out_of_tray(position)
      if is_out and not self._is_out[index]:
        self.blocks_out += 1
      self._is_out[index] = is_out

  # Success and reward.

  def condition(self, name: str) -> bool:
    """Does the condition of `name` hold at this instant."""
    return self._conditions[list(GOALS).index(name)]

  def clear_success(self) -> None:
    """Restarts every hold and latch."""
    self._holds.clear()
    self._publish_flags()

  def reward_terms(self, name: str) -> dict[str, float]:
    """The named terms of the dense reward of task `name`, at this instant."""
    goal = GOALS[name]
    values = goal.dense_terms(self._snapshot)
    if self.main_task == "unstack_stack" and goal.is_penalised_off_tray:
      values["off_tray"] = terms.off_tray_penalty(self._snapshot)
    return values

  def get_reward(self, physics) -> float:
    """The main task's reward: sparse 1 while the condition holds, or dense."""
    if self._reward == "dense":
      return float(sum(self.reward_terms(self.main_task).values()))
    return 1.0 if self.condition(self.main_task) else 0.0

  def action_spec(self, physics) -> specs.BoundedArray:
    """dx, dy, dz of the set-point and the gripper, each in [-1, 1]."""
    return specs.BoundedArray(
      (control.ACTION_SIZE,), np.float32, -1.0, 1.0, "action"
    )


def _is_in_zone(block, xy) -> bool:
  gap = max(abs(block[0] - xy[0]), abs(block[1] - xy[1]))
  return gap < ws.ZONE_HALF and block[2] < ws.FLAT_Z + ws.BLOCK_HALF


def _is_out_of_tray(position) -> bool:
  x, y, z = position
  away = max(abs(x - ws.CENTRE_XY[0]), abs(y - ws.CENTRE_XY[1]))
  return away > ws.TRAY_HALF or z < ws.INSERTED_Z - 0.01 or math.isnan(z)
