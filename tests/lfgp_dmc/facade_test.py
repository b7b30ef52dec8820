"""The facade, and the names, layout and seeds that everything shares."""

from unittest import mock

import dm_env
import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc
from lfgp_dmc import seeding
from lfgp_dmc.runs import run_folder


class _Policy:
  """Stands in for `agents.policy.Policy`."""

  tasks = ("stack", "reach")
  frame_shape = ()

  @classmethod
  def load(cls, folder):
    cls.folder = folder
    return cls()

  def begin(self, task, seed):
    pass

  def act(self, observation, task):
    return np.full(4, self.tasks.index(task), np.float32)


class FacadeTest(parameterized.TestCase):
  def test_every_export_is_there(self):
    for name in lfgp_dmc.__all__:
      self.assertTrue(hasattr(lfgp_dmc, name), name)

  def test_load_passes_everything_on(self):
    with mock.patch("lfgp_dmc.tasks.load", return_value="made") as load:
      made = lfgp_dmc.load("stack", seed=3, reward="dense")
    self.assertEqual(made, "made")
    load.assert_called_once_with("stack", seed=3, reward="dense")

  def test_load_policy_acts_for_the_named_task(self):
    config = {"control_hz": 5}
    with (
      mock.patch("lfgp_dmc.agents.policy.Policy", _Policy),
      mock.patch.object(run_folder, "read_config", return_value=config),
    ):
      main = lfgp_dmc.load_policy("runs/a")
      reach = lfgp_dmc.load_policy("runs/a", "reach")
      with self.assertRaisesRegex(ValueError, "'lift'; it has: stack, reach"):
        lfgp_dmc.load_policy("runs/a", "lift")
    observation = np.zeros(59, np.float32)
    self.assertEqual(main(observation)[0], 0)
    self.assertEqual(reach(observation)[0], 1)
    self.assertEqual(main.intentions, ("stack", "reach"))
    self.assertEqual(main.load_options, {"control_hz": 5})
    self.assertEqual(main(observation, "reach")[0], 1)
    main.intention = "reach"
    self.assertEqual(main(observation)[0], 1)

  def test_a_policy_from_pixels_says_what_it_sees(self):
    config = {"control_hz": 10, "camera_size": 48}
    with (
      mock.patch("lfgp_dmc.agents.policy.Policy", _Policy),
      mock.patch.object(_Policy, "frame_shape", (2, 48, 48, 3)),
      mock.patch.object(run_folder, "read_config", return_value=config),
    ):
      options = lfgp_dmc.load_policy("runs/a").load_options
    self.assertEqual(
      options, {"control_hz": 10, "observations": "vision", "camera_size": 48}
    )

  def test_the_layout_covers_the_59_once(self):
    slices = [
      np.arange(59)[part]
      for component in lfgp_dmc.OBSERVATION_SLICES.values()
      for part in component.slices
    ]
    self.assertEqual(sorted(np.concatenate(slices)), list(range(59)))
    self.assertLen(lfgp_dmc.OBSERVATION_SLICES, 11)

  def test_flatten_puts_blue_before_green(self):
    observation = {
      name: np.full(component.size, i, np.float64)
      for i, (name, component) in enumerate(lfgp_dmc.OBSERVATION_SLICES.items())
    }
    observation["block_positions"] = np.arange(6)
    flat = lfgp_dmc.flatten(observation)
    self.assertEqual((flat.shape, flat.dtype), ((59,), np.float32))
    self.assertEqual(flat[12:15].tolist(), [0, 1, 2])
    self.assertEqual(flat[19:22].tolist(), [3, 4, 5])
    del observation["force_torque"]
    with self.assertRaisesRegex(KeyError, "force_torque"):
      lfgp_dmc.flatten(observation)

  def test_flags_by_task(self):
    observation = {
      "success/stack": np.array(True),
      "condition/stack": np.array(False),
      "ee_position": np.zeros(3),
    }
    self.assertEqual(lfgp_dmc.successes(observation), {"stack": True})
    self.assertEqual(lfgp_dmc.conditions(observation), {"stack": False})

  def test_a_whole_timestep_is_refused(self):
    timestep = dm_env.restart({"ee_position": np.zeros(3)})
    for read in (lfgp_dmc.flatten, lfgp_dmc.successes, lfgp_dmc.conditions):
      with self.assertRaisesRegex(TypeError, "is a TimeStep; valid: the named"):
        read(timestep)
    policy = lfgp_dmc.StoredPolicy(_Policy(), "stack", {})
    for seen in (timestep, timestep.observation):
      with self.assertRaisesRegex(TypeError, "valid: what lfgp_dmc.flatten"):
        policy(seen)

  @parameterized.parameters(*lfgp_dmc.ALL_TASKS)
  def test_a_task_set_starts_with_its_main_task(self, task):
    members = lfgp_dmc.task_set(task)
    self.assertEqual(members[0], task)
    self.assertLen(set(members), len(members))
    self.assertContainsSubset(members, lfgp_dmc.ALL_TASKS)

  def test_sizes_of_the_task_sets(self):
    sizes = {task: len(lfgp_dmc.task_set(task)) for task in lfgp_dmc.ALL_TASKS}
    self.assertEqual(sizes["stack"], 6)
    self.assertEqual(sizes["insert"], 7)
    self.assertEqual(sizes["move_object"], 5)
    self.assertEqual(sizes["lift"], 1)
    with self.assertRaisesRegex(ValueError, "valid tasks: stack"):
      lfgp_dmc.task_set("juggle")


class SeedingTest(absltest.TestCase):
  def test_streams_are_those_of_the_published_results(self):
    self.assertEqual(seeding.derive(0, "evaluation", 0), 2642558586)
    self.assertEqual(seeding.derive(7, "collect", "reach", 3), 2571561659)

  def test_streams_depend_on_seed_and_path_alone(self):
    paths = [(), ("a",), ("a", 1), ("a1",), ("b", 1), (1,)]
    paths += [("a", "b"), ("ab",)]
    seeds = {seeding.derive(s, *path) for s in (0, 1) for path in paths}
    self.assertLen(seeds, 16)
    self.assertEqual(seeding.derive(5, "a", 1), seeding.derive(5, "a", 1))
    self.assertEqual(
      seeding.generator(5, "a").random(), seeding.generator(5, "a").random()
    )
