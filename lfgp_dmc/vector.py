"""Environments side by side, each in a process of its own, stepped together.

For whoever computes actions of many environments at once. Evaluation and
collection play whole episodes in each process instead (`workers.py`): nobody
waits for the slowest there.
"""

import contextlib
import multiprocessing
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection
from typing import Any

import dm_env
import numpy as np

from lfgp_dmc.acting import workers

_STEP_TYPE, _REWARD, _DISCOUNT = "step_type", "reward", "discount"
_OBSERVATION = "observation/"  # before the names of observables
_ONLY = ""  # the name of an observation that has no names


class VectorEnvironment:
  """W environments of one kind: arrays [W, ...] in, arrays [W, ...] out.

  Each goes through exactly the states of the single environment that its
  factory builds. As with `dm_env`, the step after an environment's LAST resets
  it and ignores its action.
  """

  def __init__(self, factories: Sequence[Callable[[], dm_env.Environment]]):
    """Starts the processes.

    Args:
      factories: one an environment; importable functions, or
        `functools.partial` of them, since they go to other processes.

    Raises:
      ValueError: no factory is given.
      RuntimeError: an environment could not be built.
    """
    if not factories:
      raise ValueError("a vector environment needs at least one factory")
    context = multiprocessing.get_context("spawn")
    self._pipes: list[Connection] = []
    self._processes = []
    with workers.variables():
      for factory in factories:
        ours, theirs = context.Pipe()
        process = context.Process(
          target=_serve, args=(factory, theirs), daemon=True
        )
        process.start()
        theirs.close()
        self._pipes.append(ours)
        self._processes.append(process)
    specs = [self._receive(index) for index in range(len(self))]
    self._observation_spec, self._action_spec = specs[0]
    self._records = np.zeros(len(self), _record_type(self._observation_spec))
    self._bytes = self._records.view(np.uint8).reshape(len(self), -1)

  def __len__(self) -> int:
    """W, the number of environments."""
    return len(self._pipes)

  def observation_spec(self) -> Any:
    """The specification of one of the environments."""
    return self._observation_spec

  def action_spec(self) -> Any:
    """The specification of one of the environments."""
    return self._action_spec

  def reset(self) -> dm_env.TimeStep:
    """Resets all; see `step` for what it returns."""
    return self._exchange([("reset", None)] * len(self))

  def reseed(self, seeds: Sequence[int]) -> None:
    """Environment i's next reset depends on `seeds[i]` alone."""
    if len(seeds) != len(self):
      raise ValueError(f"{len(seeds)} seeds for {len(self)} environments")
    for pipe, seed in zip(self._pipes, seeds, strict=True):
      pipe.send(("reseed", seed))

  def step(self, actions: np.ndarray) -> dm_env.TimeStep:
    """Steps all of them once.

    Args:
      actions: [W, *action shape].

    Returns:
      A time step of arrays: `step_type`, `reward` (0 at FIRST) and `discount`
      (1 at FIRST), [W] each, and the observation, or each of its entries, with
      W in front.

    Raises:
      ValueError: wrong shape, or NaN.
      RuntimeError: an environment failed; its process told why.
    """
    actions = np.asarray(actions)
    shape = (len(self), *self._action_spec.shape)
    if actions.shape != shape:
      raise ValueError(f"actions have shape {actions.shape}; valid is {shape}")
    if np.isnan(actions).any():
      raise ValueError("actions contain NaN")
    return self._exchange([("step", action) for action in actions])

  def close(self) -> None:
    """Ends the processes."""
    for pipe in self._pipes:
      with contextlib.suppress(OSError):
        pipe.send(("close", None))
      pipe.close()
    for process in self._processes:
      process.join()

  def __enter__(self) -> "VectorEnvironment":
    return self

  def __exit__(self, *unused: object) -> None:
    self.close()

  def _exchange(self, requests: Sequence[tuple[str, Any]]) -> dm_env.TimeStep:
    for pipe, request in zip(self._pipes, requests, strict=True):
      pipe.send(request)
    for index, pipe in enumerate(self._pipes):
      try:
        pipe.recv_bytes_into(self._bytes[index])
      except (EOFError, OSError):
        raise RuntimeError(f"environment {index} failed") from None
    found = self._records.copy()
    names = [name for name in found.dtype.names if _OBSERVATION in name]
    observation: Any = {
      name.removeprefix(_OBSERVATION): found[name] for name in names
    }
    if not isinstance(self._observation_spec, Mapping):
      observation = observation[_ONLY]
    return dm_env.TimeStep(
      found[_STEP_TYPE], found[_REWARD], found[_DISCOUNT], observation
    )

  def _receive(self, index: int) -> Any:
    try:
      return self._pipes[index].recv()
    except EOFError:
      raise RuntimeError(f"environment {index} could not be built") from None


def _record_type(spec: Any) -> np.dtype:
  """One time step as one record, so that it travels as plain bytes."""
  if not isinstance(spec, Mapping):
    spec = {_ONLY: spec}
  parts: list[tuple] = [
    (_STEP_TYPE, np.int64),
    (_REWARD, np.float64),
    (_DISCOUNT, np.float64),
  ]
  parts += [
    (_OBSERVATION + name, part.dtype, part.shape) for name, part in spec.items()
  ]
  return np.dtype(parts)


def _serve(factory: Callable[[], dm_env.Environment], pipe: Connection) -> None:
  """What an environment's process does."""
  workers.settle_in()
  environment = factory()
  spec = environment.observation_spec()
  pipe.send((spec, environment.action_spec()))
  record = np.zeros(1, _record_type(spec))
  row = record[0]
  with contextlib.suppress(EOFError):
    while True:
      what, value = pipe.recv()
      if what == "close":
        break
      if what == "reseed":
        environment.reseed(value)  # type: ignore[attr-defined]
        continue
      is_reset = what == "reset"
      timestep = environment.reset() if is_reset else environment.step(value)
      row[_STEP_TYPE] = timestep.step_type
      row[_REWARD] = timestep.reward or 0.0
      row[_DISCOUNT] = 1.0 if timestep.discount is None else timestep.discount
      shown = timestep.observation
      if not isinstance(spec, Mapping):
        shown = {_ONLY: shown}
      for name, part in shown.items():
        row[_OBSERVATION + name] = part
      pipe.send_bytes(record.tobytes())
  environment.close()
