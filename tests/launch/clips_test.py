"""Whose turn it is in clips: by a run's scheduler, or in play."""

from unittest import mock

from lfgp_dmc.launch import clips, policies
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.pictures import task_switch
from tests.launch import fixtures


class ClipsTest(fixtures.RunTest):
  def _spec(self, **changes):
    path, _ = self.train(self.config(**changes))
    return policies.find(str(path))

  def test_a_seed_fixes_what_a_runs_scheduler_chooses(self):
    spec = self._spec(env_steps=40)

    def choices(seed):
      choose = clips.scheduled(spec, seed)
      return [choose(step, mock.Mock()) for step in range(0, 100, 5)]

    self.assertEqual(choices(1), choices(1))
    self.assertNotEqual(choices(1), choices(2))

  def test_cloning_has_no_scheduler(self):
    spec = self._spec(algorithm="multitask_bc", env_steps=5, evaluate_every=5)
    with self.assertRaisesRegex(UserError, "a run that has a scheduler"):
      clips.scheduled(spec, 0)

  def test_play_of_a_single_task_is_that_task(self):
    environment = mock.Mock()
    play = task_switch.Play(environment, ["reach"], seed=0)
    timestep = mock.Mock(observation={"success/reach": True})
    self.assertEqual([play(step, timestep) for step in (0, 1)], 2 * ["reach"])
    self.assertEqual(environment.clear_success.call_count, 2)
