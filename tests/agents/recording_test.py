"""Updates can be recorded and replayed, as a GPU does with CUDA graphs.

`Tape` is that without a GPU: it writes down every call of torch's kernels and
makes it again on the memory of the recording. Whatever was a Python number when
it was recorded stays what it was.
"""

import numpy as np
import torch
from absl.testing import absltest, parameterized
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves, tree_map

from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.demonstration_pool import ExpertPool
from lfgp_dmc.agents.lfgp.batches import BatchMaker
from lfgp_dmc.agents.lfgp.config import LfgpConfig
from lfgp_dmc.agents.lfgp.learner import LfgpLearner
from lfgp_dmc.agents.lfgp.networks import make_networks
from lfgp_dmc.agents.networks.trunk import Standardiser

TASKS = ("main", "first", "second")
OBS, A = 6, 2
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
    self.warm_ups = self.replays = self.records = 0

  def warm_up(self, update):
    self.warm_ups += 1
    return update()

  def record(self, update):
    """A tape, unlike a graph, makes the update: the first replay is that."""
    self.records += 1
    has_replayed = False
    with Tape() as tape:
      metrics = update()

    def replay():
      nonlocal has_replayed
      self.replays += 1
      if has_replayed:
        tape.replay()
      has_replayed = True

    return metrics, replay


def _learner(config, standardiser, recorder):
  networks = make_networks(
    config,
    len(TASKS),
    A,
    standardiser,
    torch.Generator().manual_seed(1),
    torch.device("cpu"),
  )
  return LfgpLearner(
    config, networks, torch.Generator().manual_seed(2), recorder
  )


class RecordingTest(parameterized.TestCase):
  def _compare(self, updates, **fields):
    """Makes the same updates twice; returns the recorder."""
    config = LfgpConfig(
      hidden_size=16,
      batch_size=32,
      discriminator_batch_size=16,
      scheduler="weighted_random",
      **fields,
    )
    demonstrations = synthetic.demonstrations(TASKS, 100, OBS, A)
    replay = synthetic.ArrayReplay(synthetic.transitions(200, OBS, A))
    standardiser = Standardiser(OBS)
    recorder = TapeRecorder()
    learners = [_learner(config, standardiser, r) for r in (None, recorder)]
    makers = [
      BatchMaker(
        config,
        TASKS,
        replay,
        ExpertPool(demonstrations, TASKS, standardiser),
        standardiser,
        torch.device("cpu"),
        np.random.default_rng(3),
      )
      for _ in learners
    ]
    for update in range(updates):
      plain, recorded = (
        learner.update(*maker.draw(update))
        for learner, maker in zip(learners, makers, strict=True)
      )
      self.assertEqual(set(plain), set(recorded))
      for name, value in plain.items():
        torch.testing.assert_close(
          recorded[name], value, rtol=0, atol=0, equal_nan=True,
          msg=lambda text, at=(update, name): f"{at}: {text}",
        )  # fmt: skip
    for one, other in zip(
      *(learner.networks.modules().values() for learner in learners),
      strict=True,
    ):
      for a, b in zip(
        one.state_dict().values(), other.state_dict().values(), strict=True
      ):
        self.assertTrue(torch.equal(a, b))
    return recorder

  @parameterized.parameters(
    {},
    {"bfloat16": True, "critic_layer_norm": True, "actor_trunk": "own"},
    {"value_penalty": 10.0, "value_penalty_window": 4},
    {"bc_weight": 1.0, "bc_decay": 0.9, "bc_normalise": True},
    {"prior_weight": 0.5, "bc_decay": 0.9, "actor_trunk": "own"},
    {"expert_share": 0.5, "expert_share_decay": 0.9, "weight_decay": 0.01},
    {"reward_source": "examples", "value_penalty": 10.0, "bc_weight": 1.0},
    {"layout": "separate", "discriminator_input": "state"},
    {"main_discriminator_unseen": "0:2"},
  )
  def test_replays_are_the_updates(self, **fields):
    recorder = self._compare(12, **fields)
    self.assertEqual((recorder.records, recorder.replays), (1, 9))

  def test_each_phase_has_a_recording(self):
    recorder = self._compare(
      40, freeze_updates=10, intention_delay=20, discriminator_every=2
    )
    self.assertEqual(recorder.records, 6)
    self.assertEqual(recorder.warm_ups, 18)
    self.assertEqual(recorder.replays, 22)

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


if __name__ == "__main__":
  absltest.main()
