"""Estimates from a few runs: mean, interquartile mean, improvement.

The paper reports mean and standard deviation. With few seeds the interquartile
mean with stratified bootstrap intervals is the steadier summary (Agarwal et
al., "Deep reinforcement learning at the edge of the statistical precipice").
Their library, rliable, needs an older pandas than today's; SciPy has its parts.

Scores are float [R, K, T]: runs, tasks, and points such as environment steps or
numbers of demonstrations.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_TRIMMED = 0.25  # share cut from each end


class Estimate(NamedTuple):
  """A value and its band at each point, float [T] each."""

  middle: np.ndarray
  low: np.ndarray
  high: np.ndarray


def mean(scores: np.ndarray) -> Estimate:
  """Mean over runs and tasks, and one standard deviation to each side."""
  middle, std = scores.mean(axis=(0, 1)), scores.std(axis=(0, 1))
  return Estimate(middle, middle - std, middle + std)


def interquartile_mean(scores: np.ndarray) -> Estimate:
  """Mean of the middle half of all runs and tasks, and its 95 % interval."""
  import scipy.stats  # takes its time: not for --help

  def statistic(*tasks: np.ndarray, axis: int) -> np.ndarray:
    together = np.concatenate(tasks, axis=axis)
    return scipy.stats.trim_mean(together, _TRIMMED, axis=axis)

  return _bootstrap(statistic, *scores.transpose(1, 2, 0))


def probability_of_improvement(
  scores: np.ndarray, baseline: np.ndarray
) -> Estimate:
  """Chance that a run beats a run of the baseline, and its 95 % interval.

  Args:
    scores: float [R, K, T].
    baseline: float [S, K, T], the same tasks and points.

  Returns:
    The mean over tasks of P(X > Y) + P(X = Y) / 2, the Mann-Whitney statistic
    over the number of pairs.
  """
  tasks = scores.shape[1]

  def statistic(*samples: np.ndarray, axis: int) -> np.ndarray:
    del axis  # the last
    wins = [
      np.sign(x[..., :, None] - y[..., None, :]).mean(axis=(-2, -1))
      for x, y in zip(samples[:tasks], samples[tasks:], strict=True)
    ]
    return 0.5 + 0.5 * np.mean(wins, axis=0)

  return _bootstrap(
    statistic, *scores.transpose(1, 2, 0), *baseline.transpose(1, 2, 0)
  )


def share(value: float, episodes: int) -> Estimate:
  """A share of so many episodes, and Wilson's 95 % interval; [1] each."""
  import scipy.stats

  found = scipy.stats.binomtest(round(value * episodes), episodes)
  low, high = found.proportion_ci(method="wilson")
  return Estimate(*np.array([[value], [low], [high]]))


ESTIMATORS: dict[str, Callable[[np.ndarray], Estimate]] = {
  "mean": mean,
  "iqm": interquartile_mean,
}


def _bootstrap(statistic: Callable, *strata: np.ndarray) -> Estimate:
  """A statistic and its percentile interval, runs resampled in each stratum.

  Args:
    statistic: a function of the strata and `axis=-1`, vectorised.
    *strata: float [T, runs] each; a single run has a band without height.
  """
  import scipy.stats

  middle = statistic(*strata, axis=-1)
  if min(stratum.shape[-1] for stratum in strata) == 1:
    return Estimate(middle, middle, middle)
  found = scipy.stats.bootstrap(
    strata,
    statistic,
    axis=-1,
    n_resamples=2_000,
    confidence_level=0.95,
    method="percentile",
    rng=np.random.default_rng(0),
  )
  low, high = found.confidence_interval
  # Sums in another order may differ in the last digit.
  return Estimate(middle, np.minimum(low, middle), np.maximum(high, middle))
