"""Stored policies: save and load, acting, faults."""

import json
import pathlib

import numpy as np
import torch
from absl.testing import absltest, parameterized

from lfgp_dmc.agents.network_policy import NetworkPolicy
from lfgp_dmc.agents.networks import layouts
from lfgp_dmc.agents.networks.trunk import Standardiser
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.finite import NotFiniteError
from tests.fixtures import FolderTest

TASKS = ("main", "first")
OBS, A, H = 5, 3, 8


def _network(layout="shared_trunk"):
  generator = torch.Generator().manual_seed(0)
  standardiser = Standardiser(OBS)
  rows = np.random.default_rng(0).standard_normal((50, OBS))
  standardiser.fit(rows.astype(np.float32))
  return layouts.make_intentions(
    layout, standardiser, len(TASKS), H, A, generator
  )


def _policy(layout="shared_trunk"):
  return NetworkPolicy(_network(layout), TASKS)


def _observation(*shape):
  rows = np.random.default_rng(1).standard_normal((*shape, OBS))
  return rows.astype(np.float32)


class ActingTest(absltest.TestCase):
  def test_one_row_equals_the_batch(self):
    policy, rows = _policy(), _observation(4)
    batch = policy.act(rows, "first")
    self.assertEqual(batch.shape, (4, A))
    self.assertEqual(batch.dtype, np.float32)
    for row, action in zip(rows, batch, strict=True):
      np.testing.assert_allclose(
        policy.act(row, "first"), action, rtol=1e-5, atol=1e-6
      )

  def test_mean_action_of_the_standardised_observation(self):
    policy, row = _policy(), _observation()
    arrays = policy.arrays()
    features = row - arrays["standardiser.mean"]
    features /= arrays["standardiser.deviation"]
    for layer in ("first", "second"):
      weight, bias = (arrays[f"trunk.{layer}.{n}"] for n in ("weight", "bias"))
      features = np.maximum(weight @ features + bias, 0)
    hidden = features @ arrays["heads.hidden.weight"][1]
    hidden = np.maximum(hidden + arrays["heads.hidden.bias"][1, 0], 0)
    output = hidden @ arrays["heads.output.weight"][1]
    output = output + arrays["heads.output.bias"][1, 0]
    expected = np.tanh(output[:A])
    found = policy.act(row, "first")
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)

  def test_samples_follow_from_the_seed_and_surround_the_mean(self):
    policy, row = _policy(), _observation()
    policy.deterministic = False
    policy.begin("main", seed=3)
    first = [policy.act(row) for _ in range(2)]
    policy.begin("main", seed=3)
    second = [policy.act(row) for _ in range(2)]
    np.testing.assert_array_equal(first, second)
    self.assertGreater(np.abs(first[0] - first[1]).max(), 1e-4)
    rows = np.repeat(row[None], 4000, 0)
    many = policy.act(rows, generator=np.random.default_rng(0))
    mean = policy.act(row, deterministic=True)
    np.testing.assert_allclose(np.median(many, axis=0), mean, atol=0.05)

  def test_a_file_in_the_place_of_its_folder_is_named(self):
    path = pathlib.Path(__file__)
    with self.assertRaisesRegex(ValueError, "is a file; valid: the policy's f"):
      Policy.load(path)

  def test_samples_spread_by_the_networks_std(self):
    network, row = _network(), _observation()
    many = NetworkPolicy(network, TASKS).act(
      np.repeat(row[None], 4000, 0),
      "first",
      deterministic=False,
      generator=np.random.default_rng(0),
    )
    inputs = network.standardiser(torch.from_numpy(row)[None])
    with torch.no_grad():
      std = network(inputs)[1][1, 0]
    # Before the tanh; the float64 keeps digits near the ends.
    found = np.arctanh(many.astype(np.float64)).std(0)
    np.testing.assert_allclose(found, std, rtol=0.05)

  def test_a_networks_policy_acts_by_its_parameters_of_the_moment(self):
    network, row = _network(), _observation()
    policy = NetworkPolicy(network, TASKS)
    before = policy.act(row)
    stored = Policy.from_arrays(policy.arrays(), policy.options())
    with torch.no_grad():
      network.heads.output.bias += 0.5
    after = Policy.from_arrays(policy.arrays(), policy.options()).act(row)
    np.testing.assert_array_equal(stored.act(row), before)
    np.testing.assert_array_equal(policy.act(row), after)
    self.assertTrue(np.all(after != before))

  def test_observations_of_another_width_are_refused(self):
    for shape in ((OBS + 1,), (2, OBS - 1), (), (1, 1, OBS)):
      with self.assertRaisesRegex(ValueError, rf"valid: \({OBS},\) or \(B, "):
        _policy().act(np.zeros(shape, np.float32))

  def test_unknown_task_is_refused_with_the_valid_ones(self):
    policy = _policy()
    for call in (
      lambda: policy.begin("fly", 0),
      lambda: policy.act(_observation(), "fly"),
    ):
      with self.assertRaisesRegex(ValueError, "'fly'; valid: main, first"):
        call()


class StoredTest(FolderTest):
  def setUp(self):
    super().setUp()
    self.folder /= "policy"

  @parameterized.parameters("shared_trunk", "separate")
  def test_round_trip_acts_the_same(self, layout):
    policy, rows = _policy(layout), _observation(3)
    policy.save(self.folder, {"seed": 7})
    loaded = Policy.load(self.folder)
    self.assertEqual(loaded.tasks, TASKS)
    acts = policy.act(rows, "first")
    np.testing.assert_array_equal(loaded.act(rows, "first"), acts)
    config = json.loads((self.folder / "config.json").read_text())
    self.assertEqual(config["seed"], 7)

  def test_one_that_diverged_does_not_replace_the_last_good_one(self):
    _policy().save(self.folder)
    before = [path.read_bytes() for path in sorted(self.folder.iterdir())]
    network = _network()
    with torch.no_grad():
      network.heads.output.bias[0] = torch.nan
    with self.assertRaisesRegex(
      NotFiniteError, "policy of step 40 has NaN .* in heads.output.bias"
    ):
      NetworkPolicy(network, TASKS).save(self.folder, env_step=40)
    after = [path.read_bytes() for path in sorted(self.folder.iterdir())]
    self.assertEqual(after, before)

  def test_missing_and_damaged_files_are_named(self):
    _policy().save(self.folder)
    config = self.folder / "config.json"
    arrays = self.folder / "policy.safetensors"
    whole = config.read_text()
    for text in ("{", "[]", "{}", '{"policy": 3}'):
      config.write_text(text)
      self._check_refused("config.json")
    config.write_text(whole)
    arrays.write_bytes(arrays.read_bytes()[:-10])
    self._check_refused("policy.safetensors: not readable")
    arrays.unlink()
    self._check_refused("policy.safetensors is missing")
    config.unlink()
    self._check_refused("config.json is missing")

  def _check_refused(self, message):
    with self.assertRaisesRegex(ValueError, message):
      Policy.load(self.folder)

  def test_arrays_and_options_that_do_not_fit_are_listed(self):
    policy = _policy()
    arrays, options = policy.arrays(), policy.options()
    del arrays["trunk.first.bias"]
    arrays["other"] = np.zeros(1, np.float32)
    arrays["trunk.second.bias"] = np.zeros(2, np.float32)
    arrays["trunk.first.weight"][0, 0] = np.nan
    self._check_faults(
      arrays,
      options,
      "trunk.first.bias is missing",
      "other is not known",
      "trunk.second.bias has shape [2], not [8]",
      "trunk.first.weight holds numbers that are not finite",
    )
    self._check_faults(
      policy.arrays(),
      options | {"action_size": "3", "tasks": [], "scale": 1},
      "policy.tasks is []; valid: ",
      "policy.action_size is '3'; valid: a valid integer",
      "unknown policy.scale",
    )

  def _check_faults(self, arrays, options, *faults):
    with self.assertRaises(ValueError) as caught:
      Policy.from_arrays(arrays, options)
    for fault in faults:
      self.assertIn(fault, str(caught.exception))

  def test_a_policy_stored_without_a_layout_has_a_trunk(self):
    policy, row = _policy(), _observation()
    options = policy.options()
    del options["layout"]
    loaded = Policy.from_arrays(policy.arrays(), options)
    np.testing.assert_array_equal(loaded.act(row), policy.act(row))
