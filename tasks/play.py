"""The play task: one world, nine goals, the main one chosen by name."""

import math
import operator

import numpy as np
from dm_control import composer
from dm_env import specs

from lfgp_dmc.observations import components
from lfgp_dmc.task_names import MAIN_TASKS
from lfgp_dmc.tasks import control, initialisers, observables
from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.arena import PlayArena
from lfgp_dmc.tasks.cameras import Cameras
from lfgp_dmc.tasks.entities import panda_links
from lfgp_dmc.tasks.goals import GOALS, starts, terms
from lfgp_dmc.tasks.holds import Holds
from lfgp_dmc.tasks.world import World

_SETTLE_STEPS = 100
_MOST_ATTEMPTS = 200
_NO_ACTION = np.zeros(control.ACTION_SIZE)


class PlayTask(composer.Task):
  """Blocks in a tray, a Panda over it; every task's success is observed.

  Attributes:
    world: the entities, the control and the reader.
    blocks_out: times that a block left the tray, over all episodes.
    request: the start state of the next reset only; None is sampled.
  """

  def __init__(
    self,
    main_task: str,
    *,
    is_dense: bool,
    shown: str,
    camera_size: int,
    spawn: str,
    control_hz: int,
    show_rewards: bool,
  ):
    """Builds the world; `tasks.load` describes and checks the options."""
    self._goal, self._is_dense, self._spawn = GOALS[main_task], is_dense, spawn
    starts_of_both = (starts.APART, self._goal.start)
    self._never_done = [
      name for name in MAIN_TASKS if GOALS[name].start in starts_of_both
    ]
    self.world = World()
    self._holds = Holds(GOALS)
    self._action = _NO_ACTION
    self.request: initialisers.Request | None = None
    self.blocks_out = 0
    self.control_timestep = 1.0 / control_hz
    self._published: dict[str, np.ndarray] = {}
    cameras = Cameras(self.world.cameras, camera_size)
    self._observables = observables.make(
      self._published, self._read_reward, cameras, shown, show_rewards
    )

  @property
  def root_entity(self) -> PlayArena:
    """The arena that everything is attached to."""
    return self.world.arena

  @property
  def task_observables(self) -> dict:
    """The observables by name, see `observables.py`."""
    return self._observables

  # An episode.

  def after_compile(self, physics, random_state) -> None:
    """Resolves addresses, with the arm at home."""
    physics.bind(self.world.panda.joints).qpos = panda_links.HOME
    physics.forward()
    self.world.control.after_compile(physics)
    self.world.reader.after_compile(physics)
    self._look(physics, moved=False)
    self._publish(physics)

  def initialize_episode(self, physics, random_state) -> None:
    """Starts as requested; samples all else until the start is a fair one.

    Raises:
      EpisodeInitializationError: no fair start in many attempts.
      ValueError: the arm cannot reach the requested TCP, or no fair start has
        what is requested.
    """
    wanted, self.request = self.request, None
    request = wanted or initialisers.Request()
    given = request.blue is not None, request.green is not None
    where = self._spawn, self._goal.start, request
    for _ in range(_MOST_ATTEMPTS):
      initialisers.place_all(physics, random_state, self.world, *where)
      if not any(given):  # requested blocks stay where they are
        physics.step(_SETTLE_STEPS)
      physics.data.time = 0.0
      self._begin(physics)
      if self._is_fair(physics, given):
        return
      physics.reset()
    fault = f"no fair start of {self._goal.name} in {_MOST_ATTEMPTS} attempts"
    if wanted:  # Composer would try again, without the request
      raise ValueError(f"{fault} that has what is requested")
    raise composer.EpisodeInitializationError(fault)

  def _begin(self, physics) -> None:
    physics.forward()
    fingers = np.array(physics.bind(self.world.panda.finger_joints).qpos)
    self.world.reader.reset_history(fingers / panda_links.FINGER_TRAVEL)
    self._action = _NO_ACTION
    self._holds.clear()
    self._is_out = [False, False]
    self._look(physics, moved=False)
    self._publish(physics)
    self._light_zones(physics)

  def _is_fair(self, physics, given: tuple[bool, bool]) -> bool:
    """The robot touches no block but those given.

    If none is given, nothing is toppled or lost, and no main task is done, but
    those that start from another arrangement than this one and the usual.
    """
    touched = self.world.reader.robot_touches(physics)
    if any(map(operator.gt, touched, given)):
      return False
    return any(given) or (
      not any(self._conditions[name] for name in self._never_done)
      and self._goal.start.is_settled(self._snapshot)
    )

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
    self._holds.check(self._conditions.values())

  def after_step(self, physics, random_state) -> None:
    """Publishes the observation and looks after the blocks."""
    self._publish(physics)
    self._count_blocks_out()
    self._light_zones(physics)

  def _look(self, physics, moved: bool) -> None:
    self._snapshot = self.world.reader.snapshot(physics, self._action, moved)
    self._conditions = {
      name: goal.condition(self._snapshot) for name, goal in GOALS.items()
    }

  def _light_zones(self, physics) -> None:
    self.world.zones["blue"].light(physics, self._snapshot.blue)
    self.world.zones["green"].light(physics, self._snapshot.green)

  def _count_blocks_out(self) -> None:
    blocks = self._snapshot.blue, self._snapshot.green
    is_out = [_is_out_of_tray(block) for block in blocks]
    self.blocks_out += sum(map(operator.gt, is_out, self._is_out))
    self._is_out = is_out

  def _publish(self, physics) -> None:
    self._published.update(components(self.world.reader.features(physics)))
    self._publish_flags()

  def _publish_flags(self) -> None:
    self._published.update(
      observables.flags(self._holds.successes, self._conditions.values())
    )

  # Success and reward.

  def clear_success(self) -> None:
    """Restarts every hold and latch."""
    self._holds.clear()
    self._publish_flags()

  def reward_terms(self, name: str) -> dict[str, float]:
    """The named terms of the dense reward of task `name`, at this instant."""
    goal = GOALS[name]
    values = goal.dense_terms(self._snapshot)
    if self._goal.start.penalises_green and goal.is_penalised_off_tray:
      values["off_tray"] = terms.off_tray_penalty(self._snapshot)
    return values

  def _read_reward(self, name: str, physics) -> np.ndarray:
    return np.array(sum(self.reward_terms(name).values()))

  def get_reward(self, physics) -> float:
    """The main task's reward: sparse 1 while the condition holds, or dense."""
    if self._is_dense:
      return float(sum(self.reward_terms(self._goal.name).values()))
    return float(self._conditions[self._goal.name])

  def action_spec(self, physics) -> specs.BoundedArray:
    """dx, dy, dz of the set-point and the gripper, each in [-1, 1]."""
    ones = np.ones(control.ACTION_SIZE, np.float32)
    return specs.BoundedArray(ones.shape, ones.dtype, -ones, ones, "action")


def _is_out_of_tray(position) -> bool:
  x, y, z = position
  away = max(abs(x - ws.CENTRE_XY[0]), abs(y - ws.CENTRE_XY[1]))
  return away > ws.TRAY_HALF or z < ws.INSERTED_Z - 0.01 or math.isnan(z)
