"""Speed of the simulation: through dm_env, and of the physics alone."""

import time
from collections.abc import Iterator

import numpy as np

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.launch.configs import RunConfig

_RESETS = 20


def measure(
  config: RunConfig, steps: int, seed: int
) -> Iterator[tuple[str, float]]:
  """Measures on one core for `steps` control steps each time.

  Task and control rate are the config's.

  Yields:
    `control_steps_per_s`: through the dm_env interface with uniform random
    actions, resets and `flatten` included. `mj_step_per_s`: control steps'
    worth of `mj_step` alone, on scripted actions, resets apart.
    `mj_step_fraction`: the first over the second. `reset_ms`. Where pictures
    can be made, `vision_steps_per_s`: the first with both cameras' frames.
  """
  task, rate = config.main_task, config.control_hz
  environment = lfgp_dmc.load(task, seed=seed, control_hz=rate)
  played = steps / _random_play(environment, steps, seed)
  yield "control_steps_per_s", played
  alone = steps / _physics_alone(environment, task, rate, steps, seed)
  yield "mj_step_per_s", alone
  yield "mj_step_fraction", played / alone
  start = time.perf_counter()
  for _ in range(_RESETS):
    environment.reset()
  yield "reset_ms", 1000 * (time.perf_counter() - start) / _RESETS
  environment.close()
  graphics.allow_pictures()
  if not graphics.fault():
    environment = lfgp_dmc.load(
      task, seed, observations="vision", control_hz=rate
    )
    yield "vision_steps_per_s", steps / _random_play(environment, steps, seed)
    environment.close()


def _random_play(environment, steps: int, seed: int) -> float:
  """Seconds of `steps` control steps with random actions."""
  random = np.random.default_rng(seed)
  actions = random.uniform(-1, 1, (steps, 4)).astype(np.float32)
  environment.reset()  # the first one compiles
  start = time.perf_counter()
  timestep = environment.reset()
  for action in actions:
    if timestep.last():
      timestep = environment.reset()
    timestep = environment.step(action)
    lfgp_dmc.flatten(timestep.observation)
  return time.perf_counter() - start


def _physics_alone(
  environment, task: str, rate: int, steps: int, seed: int
) -> float:
  """Seconds of the physics of `steps` control steps, replayed."""
  import mujoco

  from lfgp_dmc.tasks import experts

  expert = experts.ScriptedExpert(control_hz=rate)
  model, data = environment.physics.model.ptr, environment.physics.data.ptr
  signature = mujoco.mjtState.mjSTATE_INTEGRATION
  state = np.empty(mujoco.mj_stateSize(model, signature))
  substeps = round(environment.control_timestep() / model.opt.timestep)
  seconds, done = 0.0, 0
  while done < steps:
    expert.begin(task, seed + done)
    timestep = environment.reset()
    mujoco.mj_getState(model, data, state, signature)
    controls = []
    while not timestep.last() and done < steps:
      action = expert.act(lfgp_dmc.flatten(timestep.observation))
      timestep = environment.step(action)
      controls.append(data.ctrl.copy())
      done += 1
    mujoco.mj_setState(model, data, state, signature)
    mujoco.mj_forward(model, data)
    start = time.perf_counter()
    for control in controls:
      data.ctrl[:] = control
      mujoco.mj_step(model, data, substeps)
    seconds += time.perf_counter() - start
  return seconds
