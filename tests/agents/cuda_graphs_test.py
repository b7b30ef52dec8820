"""Updates can be recorded and replayed, as a GPU does with CUDA graphs.

`Tape` is that without a GPU: it writes down every call of torch's kernels and
makes it again on the memory of the recording. Whatever was a Python number when
it was recorded stays what it was.
"""

import collections
import itertools

import torch
from absl.testing import parameterized
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves, tree_map

from lfgp_dmc.agents.lfgp.cuda_graphs import RecordedUpdates
from tests.agents import fixtures

# What would wait for the device, or gives as many rows as the data say.
_FORBIDDEN = ("_local_scalar_dense", "nonzero", "masked_select", "is_nonzero")


class Tape(TorchDispatchMode):
  """Writes calls down while it is the mode; `replay` makes them again."""

  def __init__(self):
    super().__init__()
    self._calls = []

  def __torch_dispatch__(self, func, types, args=(), kwargs=None):
    del types
    leaves = tree_leaves(args[1:])
    masks = [x for x in leaves if getattr(x, "dtype", 0) == torch.bool]
    if func._opname in _FORBIDDEN or (func._opname == "index" and masks):
      raise RuntimeError(f"{func} cannot be recorded")
    result = func(*args, **(kwargs or {}))
    if torch.Tag.inplace_view not in func.tags:  # else no number changes
      self._calls.append((func, *_aliases((args, kwargs or {}, result))))
    return result

  @torch.no_grad()
  def replay(self):
    for func, args, kwargs, result in self._calls:
      again = func(*args, **kwargs)
      for old, new in zip(tree_leaves(result), tree_leaves(again), strict=True):
        if isinstance(old, torch.Tensor) and old.data_ptr() != new.data_ptr():
          old.copy_(new)


def _aliases(tree):
  """The same memory by tensors whose shapes nobody changes later."""
  return tree_map(
    lambda x: x.detach() if isinstance(x, torch.Tensor) else x, tree
  )


class TapeRecorder:
  """A recorder that counts what it is used for."""

  def __init__(self):
    self.counts = collections.Counter()

  def warm_up(self, update):
    self.counts["warm-ups"] += 1
    return update()

  def record(self, update):
    """A tape, unlike a graph, makes the update: the first replay is that."""
    self.counts["records"] += 1
    with Tape() as tape:
      metrics = update()
    replays = itertools.chain([lambda: None], itertools.repeat(tape.replay))

    def replay():
      self.counts["replays"] += 1
      next(replays)()

    return metrics, replay


class RecordingTest(parameterized.TestCase):
  def _compare(self, updates, bfloat16=False, **fields):
    """Makes the same updates twice; returns what was recorded."""
    fields = {"scheduler.kind": "weighted_random", **fields}
    agents = [fixtures.make_agent(bfloat16=bfloat16, **fields) for _ in "ab"]
    recorder = TapeRecorder()
    agents[1].learner._recorded = RecordedUpdates(recorder)
    for update in range(updates):
      plain, recorded = (
        agent.learner.update(agent.batches.draw(update)) for agent in agents
      )
      self.assertEqual(set(plain), set(recorded))
      for name, value in plain.items():
        torch.testing.assert_close(
          recorded[name], value, rtol=0, atol=0, equal_nan=True,
          msg=lambda text, at=(update, name): f"{at}: {text}",
        )  # fmt: skip
    for one, other in zip(
      *(agent.learner.networks.modules().values() for agent in agents),
      strict=True,
    ):
      self.assertEmpty(fixtures.moved(fixtures.states(one), other))
    return recorder.counts

  @parameterized.parameters(
    {},
    {
      "bfloat16": True,
      "networks.critic_layer_norm": True,
      "networks.actor_trunk": "own",
    },
    {"critic.value_penalty": 10.0, "critic.value_penalty_window": 4},
    {"prior.weight": 0.5, "prior.decay": 0.9, "prior.normalise": True},
    {"reward.expert_share": 0.5, "reward.expert_share_decay": 0.9},
    {"optimiser.weight_decay": 0.01},
    {"reward.kind": "examples", "critic.value_penalty": 10.0},
    {"networks.layout": "separate", "reward.input": "state"},
    {"reward.main_masked": "0:2"},
    {
      "networks.layout": "separate",
      "critic.revealed": "0:2",
      "critic.revealed_after": 8,
    },
  )
  def test_replays_are_the_updates(self, **fields):
    counts = self._compare(12, **fields)
    self.assertEqual(counts, {"warm-ups": 3, "records": 1, "replays": 9})

  def test_each_phase_has_a_recording(self):
    phases = {"critic.warmup_updates": 15, "reward.every": 2}
    counts = self._compare(30, **phases)
    self.assertEqual(counts, {"warm-ups": 12, "records": 4, "replays": 18})

  def test_the_tape_refuses_what_waits_for_the_device(self):
    value = torch.arange(3.0)
    for update in (value.sum().item, lambda: value[value > 1]):
      with self.assertRaisesRegex(RuntimeError, "cannot be recorded"), Tape():
        update()

  def test_the_tape_keeps_python_numbers_as_they_were(self):
    state, number = torch.zeros(2), 1.0
    with Tape() as tape:
      state.add_(number)
    number = 5.0
    tape.replay()
    self.assertEqual(state.tolist(), [2.0, 2.0])
