"""Several seeds as one line: mean and deviation, or interquartile mean.

The paper reports mean and standard deviation. With few seeds the interquartile
mean with stratified bootstrap intervals is the steadier summary (Agarwal et
al., "Deep reinforcement learning at the edge of the statistical precipice").
Their library needs an older pandas than today's; SciPy has the same parts.
"""

from typing import NamedTuple

import numpy as np
import scipy.stats

MEAN, IQM = "mean", "iqm"
ESTIMATES = (MEAN, IQM)

_CONFIDENCE = 0.95
_RESAMPLES = 2_000
_TRIMMED = 0.25  # share cut from each end


class Estimate(NamedTuple):
  """A line and its band, each float [T]."""

  middle: np.ndarray
  low: np.ndarray
  high: np.ndarray


def estimate(scores: np.ndarray, kind: str) -> Estimate:
  """Summarises runs.

  Args:
    scores: float [runs, tasks, T]; the tasks are the strata of the bootstrap:
      runs are drawn again within each.
    kind: "mean": mean and one standard deviation to each side. "iqm": mean of
      the middle half of all runs and tasks, and its 95 % percentile interval;
      of a single run there is none, and the band has no height.

  Raises:
    ValueError: an unknown kind.
  """
  if kind not in ESTIMATES:
    raise ValueError(
      f"unknown estimate {kind!r}; valid: {', '.join(ESTIMATES)}"
    )
  if kind == MEAN:
    middle, deviation = scores.mean(axis=(0, 1)), scores.std(axis=(0, 1))
    return Estimate(middle, middle - deviation, middle + deviation)
  strata = tuple(scores.transpose(1, 0, 2))  # each [runs, T]
  middle = _interquartile_mean(*strata, axis=0)
  if len(scores) == 1:
    return Estimate(middle, middle, middle)
  interval = scipy.stats.bootstrap(
    strata,
    _interquartile_mean,
    axis=0,
    vectorized=True,
    n_resamples=_RESAMPLES,
    confidence_level=_CONFIDENCE,
    method="percentile",
    rng=np.random.default_rng(0),
  ).confidence_interval
  return Estimate(middle, interval.low, interval.high)


def _interquartile_mean(*strata: np.ndarray, axis: int) -> np.ndarray:
  together = np.concatenate(strata, axis=axis)
  return scipy.stats.trim_mean(together, _TRIMMED, axis=axis)
