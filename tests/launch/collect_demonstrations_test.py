"""The collection command: what it writes, refuses, and leaves behind."""

import functools
import os
import pathlib

import numpy as np
from absl.testing import parameterized

import lfgp_dmc
from lfgp_dmc.acting import collection
from lfgp_dmc.acting.attempts import CollectionPlan
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data import demonstrations
from lfgp_dmc.launch import command
from lfgp_dmc.tasks import experts
from tests import fixtures as shared
from tests.launch import fixtures

_ROOT = pathlib.Path(command.__file__).resolve().parents[1]


class CollectDemonstrationsTest(shared.FolderTest):
  def _call(self, line: str, status: int = 0):
    done = fixtures.call(f"collect_demonstrations.py {line}", self.folder)
    self.assertEqual(done.returncode, status, done.stderr)
    return done

  def _read(self, dataset: str, task: str):
    return demonstrations.read(
      self.folder / dataset / f"{task}.hdf5", task, 59, 4
    )

  def test_writes_a_checked_file_a_task_and_a_table(self):
    done = self._call("--task=lift --pairs_per_task=12 --seed=3 "
                      "--output=data/lift --control_hz=5")  # fmt: skip
    self.assertRegex(done.stdout, r"lift +1 of 1 attempts succeeded \(100.0%\)")
    self.assertEqual(os.listdir(self.folder / "data"), ["lift"])
    found = self._read("data/lift", "lift")
    self.assertLen(found, 12)
    self.assertEqual(
      found.attributes,
      {
        "schema_version": 1,
        "task": "lift",
        "main_task": "lift",
        "collection": "reset",
        "expert": "scripted",
        "seed": 3,
        "control_hz": 5,
      },
    )

  def test_final_pairs_come_on_top(self):
    self._call("--task=reach --pairs_per_task=5 --final_pairs=2 --output=data")
    found = self._read("data", "reach")
    self.assertLen(found, 7)
    self.assertTrue(found.is_last[5:].all())

  def test_whole_attempts_can_be_counted_instead(self):
    self._call("--task=reach --attempts_per_task=2 --output=data")
    self.assertEqual(self._read("data", "reach").attempts, 2)

  @parameterized.parameters(("reset", {"keep_longest_of": 2}), ("play", {}))
  def test_collects_what_the_flags_plan(self, kind, options):
    given = [f"--{name}={value}" for name, value in options.items()]
    given += ["--seed=4", "--control_hz=5", "--workers=1"]
    self._call(
      f"--task=reach --attempts_per_task=2 --collection={kind} --output=data "
      f"{' '.join(given)}"
    )
    found = self._read("data", "reach")
    self.assertEqual(found.attributes["collection"], kind)
    plan = CollectionPlan(
      functools.partial(lfgp_dmc.load, control_hz=5),
      functools.partial(experts.ScriptedExpert, control_hz=5),
      "reach",
      ("reach",),
      seed=4,
      control_hz=5,
      **options,
    )
    expected = collection.collect(
      plan, kind, ("reach",), 1, attempts=2, progress=False
    )["reach"].demonstrations
    for name, array in expected.arrays().items():
      np.testing.assert_array_equal(found.arrays()[name], array, name)

  def test_a_policy_demonstrates_with_sampled_actions(self):
    policy = _ROOT / "results" / "policies" / "stack"
    line = f"--expert={policy} --output=data --control_hz=5"
    self._call(f"{line} --tasks=open_gripper --pairs_per_task=12 --workers=1")
    found = self._read("data", "open_gripper")
    self.assertEqual(found.attributes["expert"], str(policy))
    mean = Policy.load(policy).act(found.observation, "open_gripper")
    self.assertGreater(np.abs(found.action - mean).max(), 1e-3)
    line = line.replace("data", "new")
    refused = self._call(f"{line} --task=insert", status=1)
    self.assertIn("cannot do insert, bring of --task=insert; it can do: stack",
                  refused.stderr)  # fmt: skip
