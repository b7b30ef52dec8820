"""Clips of a policy in its environment, by whichever rule chooses its task."""

import dataclasses
from typing import Any

import dm_env
import numpy as np

import lfgp_dmc
from lfgp_dmc import graphics, seeding
from lfgp_dmc.acting import environments
from lfgp_dmc.launch import command, policies
from lfgp_dmc.pictures import recorder, task_switch
from lfgp_dmc.runs import checkpoints, run_folder

SCHEDULED = "scheduled"


class Stage:
  """A policy in its environment; each clip depends on its seed alone."""

  def __init__(
    self,
    spec: policies.PolicySpec,
    task: str,
    look: recorder.Look,
    is_play: bool = False,
  ):
    """Builds the environment.

    Args:
      spec: the policy.
      task: an intention, or `SCHEDULED`.
      look: how frames are made.
      is_play: whether the expert goes from task to task.

    Raises:
      UserError: no pictures can be made here, or of this environment.
    """
    if fault := graphics.fault():
      raise command.UserError(fault)
    if task == SCHEDULED:
      look = dataclasses.replace(look, scheduled_for=spec.main_task)
    self._spec, self._task, self._is_play = spec, task, is_play
    self._look, self._environment = look, spec.world.build()
    with command.checked_input():
      recorder.prepare(self._environment, look)

  def play(self, seed: int, every: int = 0, **limits: Any) -> recorder.Clip:
    """Records one episode.

    Args:
      seed: of the reset, the policy and the choice of tasks.
      every: 50 ms a frame; 0: no frames.
      **limits: see `recorder.record`.

    Raises:
      UserError: there is no scheduler to choose by.
    """
    environment: Any = environments.reseeded(
      self._environment,
      self._spec.world.factory(),
      seeding.derive(seed, "clip"),
    )
    self._environment = environment
    switch = task_switch.one_task(self._task)
    if self._is_play:
      tasks = lfgp_dmc.task_set(self._spec.main_task)
      switch = task_switch.Play(environment, tasks, seed)
    elif self._task == SCHEDULED:
      switch = scheduled(self._spec, seed)
    look = dataclasses.replace(self._look, every=every)
    first, actor = environment.reset(), self._spec.make()
    return recorder.record(
      environment, actor, first, switch, seed, look, **limits
    )


def scheduled(spec: policies.PolicySpec, seed: int) -> recorder.Switch:
  """The run's own scheduler, as of its last checkpoint.

  Raises:
    UserError: a policy folder has no scheduler.
  """
  if spec.folder is None or "agent" not in spec.config:
    raise command.UserError("--task=scheduled needs the folder of a whole run")
  from lfgp_dmc.agents.schedulers import make_scheduler
  from lfgp_dmc.launch import configs

  with command.checked_input():
    agent = configs.from_dict(run_folder.settings(spec.config)).agent
    periods = -(-agent.episode_steps // agent.xi)
    scheduler = make_scheduler(
      agent, spec.tasks, 0, periods, np.random.default_rng(seed)
    )
  path = checkpoints.latest(run_folder.RunFolder(spec.folder).checkpoints)
  if path is not None:
    scheduler.load_state_dict(checkpoints.load(path)["agent"]["scheduler"])
  scheduler.begin_episode()
  chosen = ""

  def choose(step: int, timestep: dm_env.TimeStep) -> str:
    nonlocal chosen
    if step % agent.xi == 0:
      chosen = spec.tasks[scheduler.next_task()]
    return chosen

  return choose
