"""From pixels, with a fake camera: cloned, continued, trained, played."""

import unittest
from unittest import mock

import numpy as np
from absl.testing import parameterized

import lfgp_dmc
from lfgp_dmc import graphics, toy
from lfgp_dmc.acting import collection, environments
from lfgp_dmc.acting.attempts import CollectionPlan, Collector
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data import demonstrations, evaluation_csv
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import datasets
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from tests import fixtures as shared
from tests.launch import fixtures

_SHAPE = (1, 32, 32, 3)
_PLAN = CollectionPlan(
  make_environment=lambda task: shared.SeenPoint(),
  make_actor=toy.WalkingActor,
  main_task="right",
  tasks=toy.TASKS,
  seed=0,
  frame_shape=_SHAPE,
)


class PixelsTest(fixtures.RunTest):
  def setUp(self):
    super().setUp()
    found = collection.collect(_PLAN, "reset", toy.TASKS, 60, progress=False)
    self.seen = self.folder / "seen"
    self.seen.mkdir()
    for task, (data, *_) in found.items():
      attributes = {**shared.ATTRIBUTES, "task": task}
      demonstrations.write(self.seen / f"{task}.hdf5", data, attributes)

  def config(self, algorithm, **changes):
    if algorithm in ("bc", "multitask_bc"):
      small = {
        "agent.encoder.channels": 4,
        "agent.encoder.features": 8,
        "agent.encoder.shift": 1,
        "agent.learning_rate": 3e-3,
        "agent.batch_size": 16,
        "env_steps": 60,
        "checkpoint_every": 20,
      }
    else:
      small = {"agent.networks.actor_trunk": "own", "env_steps": 100}
    return super().config(
      algorithm=algorithm,
      **{
        "demonstrations": str(self.seen),
        "environment": "tests.fixtures:SeenPoint",
        **small,
        **changes,
      },
    )

  def test_collected_frames_are_those_of_the_environment(self):
    data = demonstrations.read(self.seen / "right.hdf5", "right", 1, 2, _SHAPE)
    rows = data.frame_rows()
    columns = (data.frames[rows, 0].max((1, 3)) > 0).argmax(-1)
    after = (data.frames[rows + 1, 0].max((1, 3)) > 0).argmax(-1)
    self.assertTrue((after >= columns).all())  # the expert goes right
    self.assertGreater((after > columns).mean(), 0.9)

  def test_attempts_keep_no_pixels_as_floats(self):
    (attempt,) = Collector(_PLAN)(("right", [0]))[1]
    kept = [
      part.base if part.base is not None else part for part in attempt.rows
    ]
    self.assertLess(sum(part.nbytes for part in kept), 2000)
    self.assertEqual(len(attempt.frames), len(attempt.rows.action) + 1)

  def test_clones_acts_and_resumes_to_the_same_numbers(self):
    config = self.config("multitask_bc")
    self.check_resume(config)
    run = self.folder / "runs" / "whole"
    rows = evaluation_csv.read_csv(run / "evaluation.csv")
    self.assertEqual({row.task for row in rows}, set(toy.TASKS))
    observed = shared.SeenPoint(0).reset().observation
    flat = environments.flattener(shared.SeenPoint())(observed)
    self.assertEqual(flat.shape, (1 + 32 * 32 * 3,))
    self.assertEqual(lfgp_dmc.load_policy(run, "left")(flat).shape, (2,))
    with self.assertRaisesRegex(ValueError, r"valid: \(3073,\)"):
      lfgp_dmc.load_policy(run)(flat[:7])

  def test_acting_agents_see_the_features_of_a_clone(self):
    clone, _ = self.train(self.config("multitask_bc"), "clone")
    config = self.config("lfgp", init_from=str(clone))
    self.check_resume(config)
    run = self.folder / "runs" / "whole"
    kept = Replay.stored(run / "replay")
    self.assertEqual(kept.widths, (1 + 8, 2))  # features, not frames
    before, after = Policy.load(clone), Policy.load(run)
    encoder = [k for k in before.arrays() if k.startswith("encoder.")]
    self.assertNotEmpty(encoder)
    for name in encoder:
      np.testing.assert_array_equal(before.arrays()[name], after.arrays()[name])
    self.assertEqual(after.options()["frame_shape"], list(_SHAPE))

  def test_dac_starts_from_a_clone_of_its_task(self):
    clone, _ = self.train(self.config("bc"), "clone")
    run, progress = self.train(self.config("dac", init_from=str(clone)))
    self.assertTrue(progress.is_complete)
    self.assertEqual(Policy.load(run).tasks, ("right",))

  def test_says_what_is_missing(self):
    with self.assertRaisesRegex(UserError, "config.init_from is not set: from"):
      self.train(self.config("lfgp"))
    blind, _ = self.train(super().config(algorithm="bc", env_steps=5), "blind")
    with self.assertRaisesRegex(UserError, "blind sees no pixels"):
      self.train(self.config("dac", init_from=str(blind)))
    clone, _ = self.train(self.config("multitask_bc", env_steps=5), "clone")
    with (
      mock.patch.object(
        environments, "frame_shape", lambda _: (2, *_SHAPE[1:])
      ),
      mock.patch.object(datasets, "load"),
      self.assertRaisesRegex(UserError, r"sees frames \[1, .* has \[2, 32"),
    ):
      self.train(self.config("dac", init_from=str(clone)))
    with self.assertRaisesRegex(UserError, "has no frames"):
      self.train(self.config("bc", demonstrations=str(self.dataset)))
    self.assertFalse((self.folder / "runs" / "a").exists())

  @mock.patch.object(graphics, "fault", lambda: "no pictures here")
  def test_without_gl_says_so(self):
    spec = EnvironmentSpec("reach", camera_size=64)
    with self.assertRaisesRegex(ValueError, "camera_size is 64: no pictures"):
      spec.check()
    with self.assertRaisesRegex(UserError, "no pictures here"):
      self.train(self.config("bc", environment="", main_task="reach",
                             camera_size=64))  # fmt: skip

  @parameterized.parameters(
    ({"mirror_demonstrations": True}, "mirror_demonstrations is True"),
    ({"transfer_from": "runs/x"}, "transfer_from is 'runs/x'"),
  )
  def test_what_does_not_go_with_frames(self, changes, message):
    with self.assertRaisesRegex(ValueError, message):
      self.config("lfgp", environment="", main_task="reach", camera_size=64,
                  **changes)  # fmt: skip


@unittest.skipIf(graphics.fault(), graphics.fault())
class BlockTaskTest(shared.FolderTest):
  """The commands, with the cameras of a block task."""

  def _call(self, line):
    done = fixtures.call(line, self.folder)
    self.assertEqual(done.returncode, 0, done.stderr)
    return done.stdout

  def test_collects_clones_evaluates_and_films(self):
    self._call(
      "collect_demonstrations.py --task=lift --tasks=lift --control_hz=5 "
      "--pairs_per_task=12 --camera_size=32 --workers=1 --output=data"
    )
    found = demonstrations.read(
      self.folder / "data" / "lift.hdf5", "lift", 18, 4, (2, 32, 32, 3)
    )
    self.assertGreater(np.ptp(found.frames[:, 0]), 100)
    self._call(
      "train.py --preset=pixels --config.algorithm=bc --config.main_task=lift "
      "--config.camera_size=32 --config.demonstrations=data --run=run "
      "--config.env_steps=2 --config.evaluation_episodes=1 "
      "--config.evaluation_workers=1 --config.agent.encoder.channels=4"
    )
    table = self._call(
      "evaluate.py --run=run --episodes=1 --seed=7 --workers=1"
    )
    self.assertIn("lift", table)
    self._call(
      "render_policy.py --run=run --steps=2 --height=64 --width=80 "
      "--output=seen.gif --noshadows"
    )
    self.assertTrue((self.folder / "seen.gif").exists())
