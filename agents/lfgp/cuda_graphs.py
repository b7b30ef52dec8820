"""On a GPU: an update recorded once, then replayed as one CUDA graph.

An update is some six hundred small kernels, each done before Python has
launched the next; a graph launches them all at once. It replays on the memory
of its recording, so whatever changes between updates has to be a tensor that is
written in place, never a Python number.
"""

import collections
from collections.abc import Callable, Hashable
from typing import NamedTuple

import torch

from lfgp_dmc.agents.batches import Draw
from lfgp_dmc.agents.losses import Metrics

Update = Callable[[], Metrics]

_WARM_UPS = 3  # updates before a recording, in which libraries initialise


class CudaRecorder:
  """Records on the generator's CUDA device."""

  def __init__(self, generator: torch.Generator):
    """The generator is the only source of noise; replays advance it."""
    self._generator = generator
    self._stream = torch.cuda.Stream(generator.device)

  def warm_up(self, update: Update, /) -> Metrics:
    """Makes an update on the stream that it will be recorded on."""
    current = torch.cuda.current_stream(self._generator.device)
    self._stream.wait_stream(current)
    with torch.cuda.stream(self._stream):
      metrics = update()
    current.wait_stream(self._stream)
    return metrics

  def record(self, update: Update, /) -> tuple[Metrics, Callable[[], None]]:
    """Records an update without making it: its metrics, and its replay."""
    graph = torch.cuda.CUDAGraph()
    graph.register_generator_state(self._generator)
    with torch.cuda.graph(graph, stream=self._stream):
      metrics = update()
    return metrics, graph.replay


class _Recording(NamedTuple):
  draw: Draw
  metrics: Metrics
  replay: Callable[[], None]


class RecordedUpdates:
  """Makes updates by replaying them, with a recording for each kind."""

  def __init__(self, recorder: CudaRecorder):
    self._recorder = recorder
    self._seen: collections.Counter[Hashable] = collections.Counter()
    self._recordings: dict[Hashable, _Recording] = {}

  def __call__(
    self, update: Callable[[Draw], Metrics], draw: Draw, phase: Hashable
  ) -> Metrics:
    """Makes one update; the next call overwrites its metrics.

    Each phase, with each set of shapes in the draw, has a recording of its
    own: they decide which operations `update` consists of.
    """
    key = (phase, *(tensor.shape for tensor in _tensors(draw)))
    recording = self._recordings.get(key)
    if recording is None and self._seen[key] < _WARM_UPS:
      self._seen[key] += 1
      return self._recorder.warm_up(lambda: update(draw))
    if recording is None:
      own = _copy(draw)
      metrics, replay = self._recorder.record(lambda: update(own))
      recording = self._recordings[key] = _Recording(own, metrics, replay)
    for target, source in zip(
      _tensors(recording.draw), _tensors(draw), strict=True
    ):
      target.copy_(source, non_blocking=True)
    recording.replay()
    return recording.metrics


def _tensors(draw: Draw) -> list[torch.Tensor]:
  """All tensors of a draw, always in the same order."""
  parts = [part for group in draw for part in group or ()]
  return [part for part in parts if part is not None]


def _copy(draw: Draw) -> Draw:
  """The same draw in memory of its own."""

  def copied(group):
    return group and type(group)(
      *(p if p is None else p.clone() for p in group)
    )

  return Draw(*map(copied, draw))
