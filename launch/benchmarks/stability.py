"""Does the physics hold: many random steps of every task."""

from collections.abc import Iterator, Sequence

import numpy as np

import lfgp_dmc
from lfgp_dmc import progress_bars, seeding
from lfgp_dmc.acting import environments

_HELD = 0.1  # chance of a new action, in every other episode

COLUMNS = ("steps", "nan", "warnings", "blocks_out", "max_block_speed")


def measure(
  tasks: Sequence[str], steps: int, seed: int
) -> Iterator[tuple[str, float]]:
  """Plays uniform random actions, `steps` in each task's environment.

  In every other episode each is held for ten steps on average, so that the
  hand travels and hits things.

  Yields:
    For each task and then in all: `steps`; `nan` (observations that are not
    finite, and physics failures); `warnings` (MuJoCo's counters);
    `blocks_out` (times that a block left the tray); `max_block_speed` (m/s);
    those of a task as `steps/<task>` and so on.
  """
  totals = dict.fromkeys(COLUMNS, 0.0)
  for task in tasks:
    found = _play(task, steps, seed)
    for name in COLUMNS:
      yield f"{name}/{task}", found[name]
      if name == "max_block_speed":
        totals[name] = max(totals[name], found[name])
      else:
        totals[name] += found[name]
  yield from totals.items()


def _play(task: str, steps: int, seed: int) -> dict[str, float]:
  environment = lfgp_dmc.load(
    task, seed=seeding.derive(seed, "stability", task)
  )
  random = seeding.generator(seed, "stability actions", task)
  nan = warnings = 0
  speed = 0.0
  timestep = environment.reset()
  action, change = np.zeros(4, np.float32), 1.0
  for step in progress_bars.bar(range(steps), desc=task, unit="step"):
    if random.random() < change:
      action = random.uniform(-1, 1, 4).astype(np.float32)
    timestep = environment.step(action)
    flat = lfgp_dmc.flatten(timestep.observation)
    is_failure = environments.is_physics_failure(timestep)
    nan += int(is_failure or not np.isfinite(flat).all())
    velocity = timestep.observation["block_linear_velocities"].reshape(2, 3)
    speed = max(speed, float(np.linalg.norm(velocity, axis=1).max()))
    if timestep.last() or step == steps - 1:
      # A reset clears MuJoCo's counters.
      counters = environment.physics.data.warning
      warnings += sum(int(counter.number) for counter in counters)
      timestep = environment.reset()
      change = _HELD if change == 1.0 else 1.0
  blocks_out = environment.task.blocks_out
  environment.close()
  values = (steps, nan, warnings, blocks_out, speed)
  return dict(zip(COLUMNS, map(float, values), strict=True))
