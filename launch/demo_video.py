"""The demo's video: evaluated episodes, rendered again."""

import dataclasses
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from lfgp_dmc import graphics, seeding
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from lfgp_dmc.launch import policies
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.pictures import recorder, task_switch, video
from lfgp_dmc.types import Actor

_CLIPS = 3  # intentions shown in the video
_MOST_SECONDS = 8  # of each
_EVERY = 2  # 50 ms a frame
_RATE = 20.0  # 50 ms a second


def render(
  config: RunConfig,
  path: pathlib.Path,
  trained: Sequence[EvaluationRow],
  stored: policies.PolicySpec | None,
  stored_rows: Sequence[EvaluationRow],
  size: tuple[int, int],
) -> pathlib.Path | None:
  """Shows the run at `path` on its main task, then on others.

  Last comes the stored policy on the main task. Successes are preferred. The
  size of frames is height and width, in pixels. Returns the video's path; None
  where nothing can be rendered.
  """
  if graphics.fault():
    return None
  chosen = choose_episodes(config.main_task, trained)
  actor = policies.stored_policy(str(path))
  frames = _play(config, actor, chosen, size)
  shown = [(path.name, row) for row in chosen]
  if stored is not None:
    best = choose_episodes(config.main_task, stored_rows)[:1]
    frames += _play(at_rate_of(stored, config), stored.make(), best, size)
    shown += [(stored.name, row) for row in best]
  return video.write(
    path / "video.mp4",
    frames,
    _RATE / _EVERY,
    {
      "seed": config.evaluation_seed,
      "episodes": [
        {"actor": name, "task": row.task, "episode": row.episode}
        for name, row in shown
      ],
    },
  )


def at_rate_of(stored: policies.PolicySpec, config: RunConfig) -> RunConfig:
  """The config with the control rate that a stored policy acts at."""
  rate = stored.environment_spec.control_hz
  return dataclasses.replace(config, control_hz=rate)


def _play(
  config: RunConfig,
  actor: Actor,
  episodes: Sequence[EvaluationRow],
  size: tuple[int, int],
) -> list[np.ndarray]:
  """The frames of evaluated episodes, played again."""
  environment: Any = config.environment_spec.build()
  frames: list[np.ndarray] = []
  for row in episodes:
    seed = seeding.derive(row.seed, "evaluation", row.episode)
    environment.reseed(seed)
    clip = recorder.record(
      environment,
      actor,
      environment.reset(),
      task_switch.one_task(row.task),
      seed,
      recorder.Look(*size, every=_EVERY),
      max_steps=_MOST_SECONDS * config.control_hz,
      until_success_of=row.task,
    )
    frames += clip.frames
  return frames


def choose_episodes(
  main_task: str, rows: Sequence[EvaluationRow]
) -> list[EvaluationRow]:
  """One episode of the main task and of a few others, successes if any.

  The gripper tasks come last: there is least to see.
  """
  best: dict[str, EvaluationRow] = {}
  for row in sorted(rows, key=lambda row: not row.success):
    best.setdefault(row.task, row)

  def rank(row: EvaluationRow) -> tuple:
    return row.task != main_task, not row.success, "gripper" in row.task

  return sorted(best.values(), key=rank)[:_CLIPS]
