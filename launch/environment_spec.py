"""Environments by the config's names; importable by worker processes."""

import dataclasses
import importlib
import inspect
import os
import sys
from collections.abc import Callable
from typing import Any

import dm_env

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.acting import environments, wrappers
from lfgp_dmc.observations import SUCCESS_PREFIX
from lfgp_dmc.task_names import CONTROL_RATES, check_task, task_set

_FIELD = "config.environment"


@dataclasses.dataclass(frozen=True)
class EnvironmentSpec:
  """How to build an environment; picklable."""

  main_task: str
  environment: str = ""  # of the block tasks; or `package.module:factory`
  control_hz: int = 20  # of the block tasks: 20, 10 or 5
  camera_size: int = 0  # of the block tasks' frames; 0: the 59 floats

  def build(
    self, show_rewards: bool = False, seed: int | None = None
  ) -> dm_env.Environment:
    """Builds it; `show_rewards` adds each task's dense reward, for returns.

    Raises:
      ValueError: there is no such task, factory or rate, with the valid; or
        nothing can be learned with its actions.
    """
    if self.environment:
      made = _imported(self.environment)(seed)
      try:
        return wrappers.with_unit_actions(made)
      except (AttributeError, ValueError) as error:
        raise ValueError(f"{_FIELD}={self.environment}: {error}") from None
    seen: dict[str, Any] = {}
    if self.camera_size:
      seen = {"observations": "vision", "camera_size": self.camera_size}
    return lfgp_dmc.load(
      self.main_task,
      seed,
      control_hz=self.control_hz,
      show_rewards=show_rewards,
      **seen,
    )

  def tasks(self, environment: dm_env.Environment) -> tuple[str, ...]:
    """What LfGP learns in what was built, the main task first.

    Raises:
      ValueError: what was built tells its tasks, and not this one.
    """
    if not self.environment:
      return task_set(self.main_task)
    told = environments.with_observed_tasks(environment, (), SUCCESS_PREFIX)
    if told and self.main_task not in told:
      raise ValueError(
        f"config.main_task is {self.main_task!r}; valid for {_FIELD}="
        f"{self.environment}: {', '.join(told)}"
      )
    return tuple(dict.fromkeys((self.main_task, *told)))

  @property
  def may_draw(self) -> bool:
    """Whether its observations may hold frames."""
    return bool(self.camera_size or self.environment)

  def check(self) -> None:
    """Raises ValueError if `build` would not find what it needs."""
    for name in ("main_task", "environment"):
      if not isinstance(value := getattr(self, name), str):
        raise ValueError(f"config.{name} is {value!r}; valid: a text")
    if self.environment:
      _imported(self.environment)
    else:
      check_task(self.main_task)
      if self.control_hz not in CONTROL_RATES:
        rates = ", ".join(map(str, CONTROL_RATES))
        raise ValueError(
          f"config.control_hz is {self.control_hz!r}; valid: {rates}"
        )
    if self.camera_size:
      graphics.allow_pictures()
      if fault := graphics.fault():
        raise ValueError(f"config.camera_size is {self.camera_size}: {fault}")


def _imported(path: str) -> Callable[..., dm_env.Environment]:
  """The factory, as a function of a seed or None."""
  if "" not in sys.path and os.getcwd() not in sys.path:
    sys.path.append(os.getcwd())
  module, _, name = path.partition(":")
  graphics.allow_pictures()  # there may be cameras
  try:
    make = getattr(importlib.import_module(module), name)
    signature = inspect.signature(make)
    seed = signature.parameters.get("seed")
    signature.bind(**({"seed": None} if seed else {}))
  except (ImportError, AttributeError, TypeError, ValueError) as error:
    raise ValueError(
      f"{_FIELD}={path}: {error}; valid: package.module:factory, a function "
      f"without arguments or with `seed`; looked in {os.getcwd()} and on "
      "Python's path"
    ) from None
  if seed is None:
    return lambda _: make()
  own = None if seed.default is seed.empty else seed.default
  return lambda given: make(seed=own if given is None else given)
