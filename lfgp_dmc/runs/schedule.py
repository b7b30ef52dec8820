"""When things happen in a run, and how far it is."""

import dataclasses
import math


@dataclasses.dataclass(frozen=True)
class TrainSchedule:
  """Environment steps unless said; updates where there is no environment."""

  env_steps: int  # length of the whole run
  log_every: int = 500
  evaluate_every: int = 100_000  # at the first episode end at or after
  checkpoint_every: int = 100_000  # likewise
  warmup_steps: int = 1_000  # transitions in the replay before the first update
  random_steps: int = 0  # first steps, with actions from U[-1, 1]
  updates_per_step: float = 1.0  # below 1: an update every few steps
  evaluate_first: bool = False  # also before the first step, once prepared
  progress_bar: bool = True

  def __post_init__(self):
    for name in ("log_every", "evaluate_every", "checkpoint_every"):
      if getattr(self, name) < 1:
        raise ValueError(f"{name} is {getattr(self, name)}; valid: 1 or more")
    for name in ("env_steps", "warmup_steps", "random_steps"):
      if getattr(self, name) < 0:
        raise ValueError(f"{name} is {getattr(self, name)}; valid: 0 or more")
    ratio = self.updates_per_step
    if not (math.isfinite(ratio) and ratio >= 0):
      raise ValueError(f"updates_per_step is {ratio}; valid: 0 or more")


@dataclasses.dataclass
class Progress:
  """How far a run is; `dataclasses.asdict` of it belongs in a checkpoint."""

  env_step: int = 0
  update: int = 0
  episodes: int = 0  # complete ones
  physics_failures: int = 0  # episodes dropped
  cut_episodes: int = 0  # by the end of a run that went on later
  wall_s: float = 0.0
  update_credit: float = 0.0  # the fraction of an update that is due
  is_complete: bool = False  # reached its end, which may come early in BC
  evaluation_due: bool = False  # at this step, and not made yet
