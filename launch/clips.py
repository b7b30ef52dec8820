"""Clips of a policy: of one intention, of play, or by the run's scheduler."""

import contextlib
import dataclasses
from typing import Any

import dm_env
import numpy as np

import lfgp_dmc
from lfgp_dmc import graphics, seeding
from lfgp_dmc.launch import command, policies
from lfgp_dmc.pictures import recorder, task_switch
from lfgp_dmc.runs import checkpoints, run_folder

SCHEDULED = "scheduled"


def play(
  spec: policies.PolicySpec,
  task: str,
  seed: int,
  look: recorder.Look,
  is_play: bool = False,
  **limits: Any,
) -> recorder.Clip:
  """Records one episode, in an environment of its own.

  Args:
    spec: of the policy.
    task: an intention, or `SCHEDULED`.
    seed: of the reset, the policy and the choice of tasks.
    look: of the frames.
    is_play: whether the expert goes from task to task.
    **limits: see `recorder.record`.

  Raises:
    UserError: no pictures can be made here, or of this environment, or there is
      no scheduler.
  """
  if fault := graphics.fault():
    raise command.UserError(fault)
  switch = task_switch.one_task(task)
  if task == SCHEDULED:
    look = dataclasses.replace(look, scheduled_for=spec.main_task)
    switch = scheduled(spec, seed)
  environment = spec.environment_spec.build(seed=seeding.derive(seed, "clip"))
  with contextlib.closing(environment):
    if is_play:
      tasks = lfgp_dmc.task_set(spec.main_task)
      switch = task_switch.Play(environment, tasks, seed)
    first = environment.reset()
    with command.checked_input():
      recorder.prepare(environment, look)
    return recorder.record(
      environment, spec.make(), first, switch, seed, look, **limits
    )


def scheduled(spec: policies.PolicySpec, seed: int) -> recorder.Switch:
  """The run's own scheduler, as of its last checkpoint, drawing by `seed`."""
  if spec.folder is None or "scheduler" not in spec.config.get("agent", {}):
    raise command.UserError(
      "--task=scheduled needs the folder of a run that has a scheduler"
    )
  from lfgp_dmc.agents.schedulers import make_scheduler
  from lfgp_dmc.launch import configs

  with command.checked_input():
    agent: Any = configs.from_dict(run_folder.settings(spec.config)).agent
    scheduler = make_scheduler(
      agent.scheduler, spec.tasks, np.random.default_rng(seed)
    )
  own_draws = {"generator": scheduler.state_dict()["generator"]}
  path = checkpoints.latest(run_folder.RunFolder(spec.folder).checkpoints)
  if path is not None:
    learned = checkpoints.load(path)["agent"]["scheduler"]
    try:
      scheduler.load_state_dict({**learned, **own_draws})
    except KeyError as error:
      raise command.UserError(
        f"{path} is of another version: its scheduler has no {error}"
      ) from None
  scheduler.begin_episode()
  chosen = ""

  def choose(step: int, timestep: dm_env.TimeStep) -> str:
    nonlocal chosen
    if step % agent.scheduler.xi == 0:
      chosen = spec.tasks[scheduler.next_task()]
    return chosen

  return choose
