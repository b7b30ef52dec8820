"""A stored policy, and the one implementation of acting with intentions."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic
import torch
from pydantic import Field

from lfgp_dmc.agents import fields, serialisation
from lfgp_dmc.agents.fields import NetworksConfig
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.encoder import Encoder
from lfgp_dmc.agents.networks.intentions import IntentionNetwork, to_std
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.data import array_files, files
from lfgp_dmc.runs.run_folder import ARRAYS_NAME, CONFIG_NAME, POLICY_FIELD


@fields.checked
class PolicyOptions(NetworksConfig):
  """What goes with a policy's arrays."""

  tasks: Annotated[list[fields.Text], Field(min_length=1)]
  observation_size: fields.PositiveInt
  action_size: fields.PositiveInt
  tanh_feature_scale: fields.NonNegative = 0.0
  # Of an encoder: [C, H, W, 3] of frames, of which it makes the last features
  # of an observation, and its channels.
  frame_shape: list[fields.PositiveInt] = dataclasses.field(
    default_factory=list
  )
  features: fields.Count = 0
  channels: fields.Count = 0
  env_step: fields.Count = 0  # how long it was trained


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
    """Wraps a network, which may go on being trained.

    `deterministic`: whether `act` takes tanh(mean), or a sample, by default.
    """
    self.tasks = tuple(tasks)
    self.deterministic = deterministic
    self._network = network
    self._device = network.standardiser.mean.device
    self._task = self.tasks[0]
    self._generator = np.random.default_rng(0)

  @classmethod
  def from_arrays(
    cls, arrays: Mapping[str, np.ndarray], options: Mapping[str, Any]
  ) -> "Policy":
    """Builds, on the CPU, what another's `arrays` and `options` returned.

    Raises:
      ValueError: an option is missing or wrong, or the arrays do not fit;
        the message lists each fault.
    """
    try:
      checked = PolicyOptions(**options)
    except pydantic.ValidationError as error:
      faults = fields.faults(error, options, POLICY_FIELD)
      raise ValueError("; ".join(faults)) from None
    encoder, unused = None, torch.Generator()
    if checked.frame_shape:
      encoder = Encoder(
        checked.observation_size - checked.features,
        checked.frame_shape,
        checked.features,
        checked.channels,
        unused,
      )
    network = layouts.make_intentions(
      checked.layout,
      Standardiser(checked.observation_size, checked.tanh_feature_scale),
      len(checked.tasks),
      checked.hidden_size,
      checked.action_size,
      unused,
      encoder=encoder,
    )
    serialisation.load_module_state(network, arrays, "policy arrays")
    return cls(network.requires_grad_(False), checked.tasks)

  @classmethod
  def load(cls, folder: str | os.PathLike[str]) -> "Policy":
    """Reads a policy folder: `config.json` and `policy.safetensors`.

    Raises:
      ValueError: a file is missing or damaged; the message names it.
      OSError: a file may not be read.
    """
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
    except (ValueError, RuntimeError) as error:  # torch: too large
      raise ValueError(f"{arrays_path}: {error}") from error

  def save(
    self,
    folder: str | os.PathLike[str],
    config: Mapping[str, Any] | None = None,
    env_step: int = 0,
  ) -> None:
    """Writes a policy folder, each file whole or not at all.

    `config` is what else `config.json` holds, such as the run's config.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    array_files.write(folder / ARRAYS_NAME, self.arrays())
    options = {**self.options(), "env_step": env_step}
    files.write_json(
      folder / CONFIG_NAME, {**(config or {}), POLICY_FIELD: options}
    )

  def arrays(self) -> dict[str, np.ndarray]:
    """Everything acting needs, by name, copied."""
    return serialisation.module_state(self._network)

  def options(self) -> dict[str, Any]:
    """The JSON-able options that `from_arrays` takes beside the arrays."""
    network, encoder = self._network, self.encoder
    seen = {}
    if encoder is not None:
      seen = {
        "frame_shape": list(encoder.frame_shape),
        "features": encoder.features,
        "channels": encoder.channels,
      }
    return seen | {
      "tasks": list(self.tasks),
      "observation_size": network.standardiser.mean.shape[0],
      "action_size": self.action_size,
      "hidden_size": network.heads.output.weight.shape[1],
      "layout": layouts.layout_of(network.heads),
      "tanh_feature_scale": network.standardiser.tanh_feature_scale,
    }

  @property
  def encoder(self) -> Encoder | None:
    """What turns frames into features, if it acts from pixels."""
    return self._network.encoder

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
    with torch.inference_mode():
      raw = torch.as_tensor(
        observation, dtype=torch.float32, device=self._device
      )
      network = self._network
      width = network.standardiser.mean.shape[0]
      rows = raw if raw.dim() > 1 else raw[None]
      encoder = network.encoder
      if encoder is not None and rows.shape[-1] != width:
        width = encoder.observation_size
      if raw.dim() not in (1, 2) or rows.shape[-1] != width:
        raise ValueError(
          f"observation has shape {tuple(raw.shape)}; valid: ({width},) or "
          f"(B, {width})"
        )
      if encoder is not None and width == encoder.observation_size:
        rows = encoder.observe(rows)
      inputs = network.standardiser(rows)
      mean, std = network.heads.one(network.trunk(inputs), index)
      if not deterministic:
        source = self._generator if generator is None else generator
        noise = source.standard_normal(mean.shape, np.float32)
        mean = mean + to_std(std) * torch.from_numpy(noise).to(self._device)
      action = torch.tanh(mean).cpu().numpy()
    return action if raw.dim() > 1 else action[0]

  def _index(self, task: str) -> int:
    if task not in self.tasks:
      raise ValueError(
        f"the policy has no task {task!r}; valid: {', '.join(self.tasks)}"
      )
    return self.tasks.index(task)
