"""Film strips: successful episodes as rows of frames."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from absl import logging

from lfgp_dmc import seeding
from lfgp_dmc.launch import policies, task_switch
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.pictures import recorder, video
from lfgp_dmc.pictures.recorder import Clip, Look


def play(
  cast: policies.Cast,
  task: str,
  seed: int,
  look: Look,
  *,
  is_play: bool = False,
  max_steps: int | None = None,
  until_success: bool = False,
  environment=None,
) -> Clip:
  """One episode; its reset and actor depend on `seed` alone.

  Args:
    cast: who acts.
    task: an intention, or `task_switch.SCHEDULED`.
    seed: of the reset, the actor and the choices.
    look: how frames are made.
    is_play: the expert goes from task to task.
    max_steps: control steps at most.
    until_success: stop a second after the task's success.
    environment: to play in if it can be reseeded; else one is built.
  """
  derived = seeding.derive(seed, "clip")
  if hasattr(environment, "reseed"):
    world = environment
    world.reseed(derived)
  else:
    world = cast.world.build(seed=derived)
  if task == task_switch.SCHEDULED:
    look = dataclasses.replace(look, scheduled_for=cast.main_task)
  try:
    first = world.reset()
    goal = cast.main_task if task == task_switch.SCHEDULED else task
    return recorder.record(
      world,
      cast.make(),
      first,
      task_switch.make_switch(cast, task, is_play, world, seed),
      seed,
      look,
      max_steps,
      goal if until_success else None,
    )
  finally:
    if world is not environment:
      world.close()


def rows(
  casts: Sequence[policies.Cast],
  seed: int,
  look: Look,
  columns: int,
  attempts: int,
) -> tuple[np.ndarray, list[dict[str, int | str]]]:
  """A successful episode of each actor's main task as a row of frames.

  Args:
    casts: a row each.
    seed: of the first attempt; the next ones count on.
    look: how frames are made.
    columns: frames a row, from the reset to the success.
    attempts: episodes to try for a success.

  Returns:
    The picture, uint8 [rows * height, columns * width, 3], and what its rows
    show.

  Raises:
    UserError: an actor had no success.
  """
  cells: list[list[np.ndarray]] = []
  shown: list[dict[str, int | str]] = []
  for cast in casts:
    task = cast.main_task
    world = cast.world.build()
    found = _success(cast, task, range(seed, seed + attempts), look, world)
    steps = np.linspace(0, found[1], columns).round().astype(int)
    clip = play(
      cast,
      task,
      found[0],
      dataclasses.replace(look, every=1),
      max_steps=int(steps[-1]),
      environment=world,
    )
    world.close()
    cells += [[clip.frames[step * clip.checks]] for step in steps]
    shown.append({"task": task, "actor": cast.name, "seed": found[0],
                  "success_at": found[1]})  # fmt: skip
  return video.grid(cells, columns)[0], shown


def _success(cast, task: str, seeds, look: Look, world) -> tuple[int, int]:
  """The first seed with a success, and its step; played without pictures."""
  blind = dataclasses.replace(look, every=0)
  for seed in seeds:
    clip = play(cast, task, seed, blind, until_success=True, environment=world)
    if task in clip.first_success:
      return seed, clip.first_success[task]
    logging.info("%s on %s: no success with seed %d", cast.name, task, seed)
  raise UserError(
    f"{cast.name} had no success of {task} in {len(seeds)} episodes; try more "
    "--attempts or another --seed"
  )
