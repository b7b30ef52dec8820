"""A stored policy, and the one implementation of acting with intentions.

In NumPy: a product of one row takes no library of networks, and what acts
starts at once, wherever it runs.
"""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pydantic

from lfgp_dmc import finite
from lfgp_dmc.agents import fields, vision
from lfgp_dmc.agents import policy_options as names
from lfgp_dmc.agents.policy_options import PolicyOptions
from lfgp_dmc.data import array_files, files
from lfgp_dmc.runs.run_folder import ARRAYS_NAME, CONFIG_NAME, POLICY_FIELD


class Policy:
  """Intentions by task name: observation in, action out.

  Also an `lfgp_dmc.types.Actor`: `begin(task, seed)`, then `act(observation)`.

  Attributes:
    tasks: the intentions' names.
    deterministic: whether `act` takes tanh(mean), or a sample, by default.
    frame_shape: [C, H, W, 3] of what it sees; empty if it has no encoder.
  """

  def __init__(
    self,
    arrays: Mapping[str, np.ndarray],
    tasks: Sequence[str],
    tanh_feature_scale: float = 0.0,
    frame_shape: Sequence[int] = (),
  ):
    """Takes arrays by their names in stored policies."""
    self.tasks = tuple(tasks)
    self.deterministic = True
    self.frame_shape = tuple(frame_shape)
    self._arrays = arrays
    self._scale = tanh_feature_scale
    self._hidden = [name for name in names.HIDDEN if f"{name}.weight" in arrays]
    self._task = self.tasks[0]
    self._generator = np.random.default_rng(0)

  @classmethod
  def from_arrays(
    cls, arrays: Mapping[str, np.ndarray], options: Mapping[str, Any]
  ) -> "Policy":
    """Builds what another's `arrays` and `options` returned.

    Raises:
      ValueError: an option is missing or wrong, or the arrays do not fit;
        the message lists each fault.
    """
    try:
      checked = PolicyOptions(**options)
    except pydantic.ValidationError as error:
      faults = fields.faults(error, options, POLICY_FIELD)
      raise ValueError("; ".join(faults)) from None
    fields.check_arrays(arrays, checked.shapes(), "policy arrays")
    single = {name: np.asarray(a, np.float32) for name, a in arrays.items()}
    scale, shape = checked.tanh_feature_scale, checked.frame_shape
    return Policy(single, checked.tasks, scale, shape)

  @classmethod
  def from_state(
    cls, state: Mapping[str, Any], options: Mapping[str, Any]
  ) -> "Policy":
    """Builds the policy of an agent's `state_dict()`, such as checkpoints hold.

    Raises:
      ValueError: see `from_arrays`.
    """
    arrays = state.get("best")  # of behaviour cloning
    if arrays is None:
      arrays = state["learner"]["networks"]["intentions"]
    return cls.from_arrays(arrays, options)

  @classmethod
  def load(cls, folder: str | os.PathLike[str]) -> "Policy":
    """Reads a policy folder: `config.json` and `policy.safetensors`.

    Raises:
      ValueError: a file is missing or damaged; the message names it.
      OSError: a file may not be read.
    """
    if Path(folder).is_file():
      raise ValueError(f"{folder} is a file; valid: the policy's folder")
    config_path = Path(folder) / CONFIG_NAME
    arrays_path = Path(folder) / ARRAYS_NAME
    for path in (config_path, arrays_path):
      if not path.is_file():
        raise ValueError(f"no policy in {folder}: {path} is missing")
    try:
      options = files.read_json(config_path)[POLICY_FIELD]
    except (ValueError, KeyError, TypeError) as error:
      raise ValueError(
        f"{config_path}: no policy options under {POLICY_FIELD!r} ({error!r})"
      ) from error
    if not isinstance(options, dict):
      raise ValueError(f"{config_path}: {POLICY_FIELD!r} is not an object")
    arrays = array_files.read(arrays_path)
    try:
      return cls.from_arrays(arrays, options)
    except ValueError as error:
      raise ValueError(f"{arrays_path}: {error}") from error

  def save(
    self,
    folder: str | os.PathLike[str],
    config: Mapping[str, Any] | None = None,
    env_step: int = 0,
  ) -> None:
    """Writes a policy folder, each file whole or not at all.

    `config` is what else `config.json` holds, such as the run's config.

    Raises:
      NotFiniteError: its arrays hold NaN, as after learning that diverged;
        what the folder held stays.
    """
    arrays = self.arrays()
    if not all(map(finite.is_finite, arrays.values())):
      raise finite.fault(f"the policy of step {env_step}", arrays)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    array_files.write(folder / ARRAYS_NAME, arrays)
    options = {**self.options(), "env_step": env_step}
    files.write_json(
      folder / CONFIG_NAME, {**(config or {}), POLICY_FIELD: options}
    )

  def arrays(self) -> dict[str, np.ndarray]:
    """Everything acting needs, by name, copied."""
    return {name: np.array(array) for name, array in self._arrays.items()}

  def options(self) -> dict[str, Any]:
    """The JSON-able options that `from_arrays` takes beside the arrays."""
    shapes = {name: array.shape for name, array in self._arrays.items()}
    is_separate = f"{names.SECOND}.weight" in shapes
    seen = {}
    if self.frame_shape:
      seen = {
        "frame_shape": list(self.frame_shape),
        "features": shapes["encoder.output.weight"][0],
        "channels": shapes["encoder.sharpness"][0],
      }
    return seen | {
      "tasks": list(self.tasks),
      "observation_size": shapes[names.MEAN][0],
      "action_size": self.action_size,
      "hidden_size": shapes[f"{names.OUTPUT}.weight"][1],
      "layout": "separate" if is_separate else "shared_trunk",
      "tanh_feature_scale": self._scale,
    }

  @property
  def action_size(self) -> int:
    """A, floats of an action."""
    return self._arrays[f"{names.OUTPUT}.weight"].shape[-1] // 2

  def begin(self, task: str, seed: int) -> None:
    """Starts an attempt at `task`; samples follow from `seed`.

    Raises:
      ValueError: the policy has no such task.
    """
    self._index(task)
    self._task = task
    self._generator = np.random.default_rng(seed)

  def act(
    self,
    observation: np.ndarray,
    task: str | None = None,
    deterministic: bool | None = None,
    generator: np.random.Generator | None = None,
  ) -> np.ndarray:
    """Chooses actions: raw float32 [O] or [B, O] -> [A] or [B, A] in [-1, 1].

    Args:
      observation: one, or a batch; with an encoder, its pixels or features.
      task: whose intention acts; None: the task that `begin` named.
      deterministic: tanh(mean), or a sample; None: the policy's own setting.
      generator: source of the sample; None: the one that `begin` seeded.

    Raises:
      ValueError: the policy has no such task, or takes other observations.
    """
    index = self._index(self._task if task is None else task)
    if deterministic is None:
      deterministic = self.deterministic
    raw = np.asarray(observation, np.float32)
    width = self._arrays[names.MEAN].shape[0]
    encodes = bool(self.frame_shape) and raw.shape[-1:] != (width,)
    if encodes:
      own = width - len(self._read("encoder.output.bias"))
      width = own + math.prod(self.frame_shape)
    if raw.ndim not in (1, 2) or raw.shape[-1] != width:
      raise ValueError(
        f"observation has shape {raw.shape}; valid: ({width},) or (B, {width})"
      )
    rows = np.atleast_2d(raw)
    if encodes:
      features = self.encode(rows[:, own:].reshape(-1, *self.frame_shape))
      rows = np.hstack([rows[:, :own], features])
    mean, std = np.split(self._gaussian(rows, index), 2, axis=-1)
    if not deterministic:
      source = self._generator if generator is None else generator
      noise = source.standard_normal(mean.shape, np.float32)
      mean = mean + (np.logaddexp(0, std) + 1e-7) * noise
    action = np.tanh(mean)
    return action if raw.ndim > 1 else action[0]

  def encode(self, frames: np.ndarray) -> np.ndarray:
    """Features, float32 [N, F], of frames [N, C, H, W, 3], 0 to 255."""
    return vision.encode(self._read, frames)

  def _gaussian(self, raw: np.ndarray, index: int) -> np.ndarray:
    """Mean and raw std before the tanh, [B, 2A], for observations [B, O]."""
    rows = (raw - self._read(names.MEAN, index)) / self._read(names.STD, index)
    if self._scale:
      rows = np.concatenate([rows, np.tanh(raw / self._scale)], axis=-1)
    for name in self._hidden:
      rows = np.maximum(self._linear(name, rows, index), 0)
    return self._linear(names.OUTPUT, rows, index)

  def _linear(self, name: str, rows: np.ndarray, index: int) -> np.ndarray:
    weight = self._read(f"{name}.weight", index)
    if not name.startswith(names.HEADS):
      weight = weight.T  # torch's own layers are [outputs, inputs]
    return rows @ weight + self._read(f"{name}.bias", index)

  def _read(self, name: str, index: int = 0) -> np.ndarray:
    """An array, or a task's part of those that differ by task."""
    array = self._arrays[name]
    return array[index] if name.startswith(names.HEADS) else array

  def _index(self, task: str) -> int:
    if task not in self.tasks:
      raise ValueError(
        f"the policy has no task {task!r}; valid: {', '.join(self.tasks)}"
      )
    return self.tasks.index(task)
