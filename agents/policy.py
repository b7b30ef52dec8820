"""A stored policy, and the one implementation of acting with intentions."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import safetensors.numpy
import torch

from lfgp_dmc.agents import serialisation
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.intentions import IntentionNetwork, to_std
from lfgp_dmc.agents.networks.trunk import Standardiser

ARRAYS_FILE = "policy.safetensors"
CONFIG_FILE = "config.json"
# Under this key of `config.json` are the options of `Policy.from_arrays`.
CONFIG_KEY = "policy"
_SIZES = ("observation_size", "action_size", "hidden_size")


class Policy:
  """Intentions by task name: observation in, action out.

  Also an `lfgp_dmc.types.Actor`: `begin(task, seed)`, then `act(observation)`.
  """

  def __init__(
    self,
    network: IntentionNetwork,
    tasks: Sequence[str],
    deterministic: bool = True,
  ):
    """Wraps a network; it may go on being trained.

    Args:
      network: K heads.
      tasks: names of the K tasks.
      deterministic: what `act` does unless told: tanh(mean), or a sample.
    """
    self.tasks = tuple(tasks)
    self.deterministic = deterministic
    self._network = network
    self._indices = {task: index for index, task in enumerate(self.tasks)}
    self._device = network.standardiser.mean.device
    self._task = self.tasks[0]
    self._generator = np.random.default_rng(0)

  @classmethod
  def from_arrays(
    cls, arrays: Mapping[str, np.ndarray], options: Mapping[str, Any]
  ) -> "Policy":
    """Builds a policy from what an agent's `policy_arrays` returned.

    Args:
      arrays: name -> array.
      options: `tasks` (list of str), `observation_size`, `action_size`,
        `hidden_size` (int), `layout` (of `networks/layouts.py`; missing: a
        shared trunk), `tanh_feature_scale` (missing: 0): an agent's
        `policy_options`.

    Returns:
      The policy, on the CPU.

    Raises:
      ValueError: an option is missing or wrong, or the arrays do not fit;
        the message lists each fault.
    """
    faults = [
      f"{name} is {options.get(name)!r}; valid: an integer above 0"
      for name in _SIZES
      if not isinstance(options.get(name), int) or options[name] < 1
    ]
    tasks = options.get("tasks")
    if not isinstance(tasks, list | tuple) or not tasks:
      faults.append(f"tasks is {tasks!r}; valid: a list of task names")
    layout = options.get("layout", layouts.SHARED_TRUNK)
    if layout not in layouts.LAYOUTS:
      faults.append(
        f"layout is {layout!r}; valid: {', '.join(layouts.LAYOUTS)}"
      )
    if faults:
      raise ValueError(f"policy options: {'; '.join(faults)}")
    assert tasks is not None
    observations, actions, hidden = (options[name] for name in _SIZES)
    scale = float(options.get("tanh_feature_scale", 0.0))
    standardiser = Standardiser(observations, scale)
    network = layouts.make_intentions(
      layout, standardiser, len(tasks), hidden, actions, torch.Generator()
    )
    serialisation.load_module_state(network, arrays, "policy arrays")
    return cls(network.requires_grad_(False), tasks)

  @classmethod
  def load(cls, folder: str | os.PathLike[str]) -> "Policy":
    """Reads a policy folder: `config.json` and `policy.safetensors`.

    Raises:
      FileNotFoundError: a file is missing; the message names it.
      ValueError: a file is damaged; the message names it and the fault.
    """
    config_path = Path(folder) / CONFIG_FILE
    arrays_path = Path(folder) / ARRAYS_FILE
    for path in (config_path, arrays_path):
      if not path.is_file():
        raise FileNotFoundError(f"no policy in {folder}: {path} is missing")
    try:
      options = json.loads(config_path.read_text())[CONFIG_KEY]
    except (OSError, ValueError, KeyError, TypeError) as error:
      raise ValueError(
        f"{config_path}: no policy options under {CONFIG_KEY!r} ({error!r})"
      ) from error
    if not isinstance(options, dict):
      raise ValueError(f"{config_path}: {CONFIG_KEY!r} is not an object")
    try:
      arrays = safetensors.numpy.load_file(arrays_path)
    except (OSError, safetensors.SafetensorError) as error:
      raise ValueError(f"{arrays_path}: not readable ({error!r})") from error
    try:
      return cls.from_arrays(arrays, options)
    except ValueError as error:
      raise ValueError(f"{arrays_path}: {error}") from error

  def save(
    self,
    folder: str | os.PathLike[str],
    config: Mapping[str, Any] | None = None,
  ) -> None:
    """Writes a policy folder.

    Args:
      folder: made if missing.
      config: what else `config.json` says, such as the run's config.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    content = {**(config or {}), CONFIG_KEY: self.options()}
    text = json.dumps(content, indent=2) + "\n"
    (Path(folder) / CONFIG_FILE).write_text(text)
    safetensors.numpy.save_file(self.arrays(), Path(folder) / ARRAYS_FILE)

  def arrays(self) -> dict[str, np.ndarray]:
    """Everything acting needs, by name, copied."""
    return serialisation.module_state(self._network)

  def options(self) -> dict[str, Any]:
    """The JSON-able options that `from_arrays` takes beside the arrays."""
    network = self._network
    return {
      "tasks": list(self.tasks),
      "observation_size": network.standardiser.mean.shape[0],
      "action_size": self.action_size,
      "hidden_size": network.heads.output.weight.shape[1],
      "layout": layouts.layout_of(network.heads),
      "tanh_feature_scale": network.standardiser.tanh_feature_scale,
    }

  @property
  def action_size(self) -> int:
    """A, floats of an action."""
    return self._network.heads.output.weight.shape[-1] // 2

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
    """Chooses actions.

    Args:
      observation: float32 [O] or [B, O], raw.
      task: whose intention acts; None: the task that `begin` named.
      deterministic: True: tanh(mean). False: a sample. None: the policy's
        own setting.
      generator: source of the sample; None: the one that `begin` seeded.

    Returns:
      float32 [A] or [B, A], within [-1, 1].

    Raises:
      ValueError: the policy has no such task.
    """
    index = self._index(self._task if task is None else task)
    if deterministic is None:
      deterministic = self.deterministic
    with torch.inference_mode():
      raw = torch.as_tensor(
        observation, dtype=torch.float32, device=self._device
      )
      network = self._network
      inputs = network.standardiser(raw if raw.dim() > 1 else raw[None])
      mean, std = network.heads.one(network.trunk(inputs), index)
      if not deterministic:
        source = self._generator if generator is None else generator
        noise = source.standard_normal(mean.shape, np.float32)
        mean = mean + to_std(std) * torch.from_numpy(noise).to(self._device)
      action = torch.tanh(mean).cpu().numpy()
    return action if raw.dim() > 1 else action[0]

  def _index(self, task: str) -> int:
    try:
      return self._indices[task]
    except KeyError:
      raise ValueError(
        f"the policy has no task {task!r}; valid: {', '.join(self.tasks)}"
      ) from None
