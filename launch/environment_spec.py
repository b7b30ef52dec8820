"""Environments by the config's names; importable by worker processes."""

import dataclasses
import importlib
import inspect
from collections.abc import Callable

import dm_env

import lfgp_dmc
from lfgp_dmc.task_names import check_task


@dataclasses.dataclass(frozen=True)
class EnvironmentSpec:
  """How to build an environment; picklable."""

  main_task: str
  environment: str = ""  # of the block tasks; or `package.module:factory`
  control_hz: int = 20  # of the block tasks: 20, 10 or 5

  def build(
    self, show_rewards: bool = False, seed: int | None = None
  ) -> dm_env.Environment:
    """Builds it; `show_rewards` adds each task's dense reward, for returns.

    Raises:
      ValueError: there is no such task, factory or rate; lists the valid.
    """
    if self.environment:
      make = _imported(self.environment)
      if seed is not None and "seed" in inspect.signature(make).parameters:
        return make(seed=seed)
      return make()
    return lfgp_dmc.load(
      self.main_task,
      seed,
      control_hz=self.control_hz,
      show_rewards=show_rewards,
    )

  def check(self) -> None:
    """Raises ValueError if `build` would not find what it needs."""
    if self.environment:
      _imported(self.environment)
    else:
      check_task(self.main_task)


def _imported(path: str) -> Callable[..., dm_env.Environment]:
  module_name, _, name = path.partition(":")
  try:
    return getattr(importlib.import_module(module_name), name)
  except (ImportError, AttributeError) as error:
    raise ValueError(
      f"config.environment={path}: {error}; valid: package.module:factory"
    ) from None
