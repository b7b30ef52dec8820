"""Starts from cloned behaviour, and whether it is kept."""

from unittest import mock

import numpy as np
import torch
from absl import logging
from absl.testing import absltest, parameterized

from lfgp_dmc import toy
from lfgp_dmc.acting import collection, environments, evaluation
from lfgp_dmc.acting.attempts import Plan
from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.lfgp import LfgpConfig, build
from lfgp_dmc.agents.lfgp.prior import entropies
from lfgp_dmc.agents.policy import Policy
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.runs import loop, metrics
from lfgp_dmc.runs.schedule import TrainSchedule

TASKS = ("stack", "reach", "lift")
OBS, A = 6, 2


def _build(tasks=TASKS, seed=0, **fields):
  settings = {
    "hidden_size": 16,
    "batch_size": 32,
    "discriminator_batch_size": 32,
  }
  return build(
    LfgpConfig(**(settings | fields)),
    tasks,
    synthetic.demonstrations(tasks, 100, OBS, A),
    synthetic.ArrayReplay(synthetic.transitions(200, OBS, A)),
    seed,
    "cpu",
    OBS,
    A,
  )


def _distance(agent, shown):
  """The mean distance of actions from those that the expert showed."""
  squares = [
    np.square(agent.policy.act(data.observation, task) - data.action).sum(1)
    for task, (data, *_) in shown.items()
  ]
  return float(np.sqrt(np.mean(squares)))


def _states(module):
  return {k: v.clone() for k, v in module.state_dict().items()}


class FreezeTest(parameterized.TestCase):
  @parameterized.parameters("shared", "own")
  def test_the_intentions_trunk_waits(self, actor_trunk):
    agent = _build(
      actor_trunk=actor_trunk,
      freeze_updates=2,
      weight_decay=0.01,
      bc_weight=1.0,
      intention_learning_rate=1e-3,
    )
    networks = agent.learner.networks
    trunk = networks.intentions.trunk
    start, heads = _states(trunk), _states(networks.critics.heads)
    for _ in range(2):
      agent.update()
    torch.testing.assert_close(_states(trunk), start, rtol=0, atol=0)
    moved = networks.critics.heads.state_dict()
    self.assertFalse(torch.equal(moved["bias"], heads["bias"]))
    agent.update()
    self.assertFalse(torch.equal(trunk.first.weight, start["first.weight"]))

  def test_a_warm_start_trains_the_common_trunk_before(self):
    agent = _build(
      freeze_updates=5, bc_warm_start_updates=20, bc_learning_rate=1e-3
    )
    networks = agent.learner.networks
    self.assertIs(networks.intentions.trunk, networks.critics.trunk)
    start = _states(networks.critics.trunk)
    agent.prepare()
    cloned = _states(networks.critics.trunk)
    self.assertFalse(torch.equal(cloned["first.weight"], start["first.weight"]))
    self.assertFalse(networks.intentions.owns_trunk)
    torch.testing.assert_close(_states(networks.target_critics.trunk), cloned)
    agent.update()
    torch.testing.assert_close(_states(networks.critics.trunk), cloned)


class CautiousStartTest(parameterized.TestCase):
  def test_intentions_and_temperatures_wait_for_the_critics(self):
    agent = _build(intention_delay=2, intention_learning_rate=1e-3)
    networks = agent.learner.networks
    heads, critics = (
      _states(networks.intentions.heads),
      _states(networks.critics),
    )
    for _ in range(2):
      agent.update()
    torch.testing.assert_close(
      _states(networks.intentions.heads), heads, rtol=0, atol=0
    )
    self.assertEqual(networks.log_temperature.tolist(), [0.0] * len(TASKS))
    moved = networks.critics.state_dict()
    self.assertFalse(torch.equal(moved["heads.bias"], critics["heads.bias"]))
    agent.update()
    moved = networks.intentions.heads.state_dict()
    self.assertFalse(torch.equal(moved["output.bias"], heads["output.bias"]))
    self.assertNotEqual(networks.log_temperature[0].item(), 0.0)

  def test_cloned_intentions_get_the_deviation_that_is_asked(self):
    agent = _build(bc_warm_start_updates=1, cloned_deviation=0.1)
    agent.prepare()
    rows = torch.randn(7, OBS)
    _, deviation = agent.learner.networks.intentions(rows)
    torch.testing.assert_close(deviation, torch.full_like(deviation, 0.1))

  def test_likelihood_learns_how_precise_the_expert_is(self):
    shown = synthetic.demonstrations(TASKS, 100, OBS, A)
    random = np.random.default_rng(0)
    for data in shown.values():  # the second action precise, the first not
      data.action[:, 0] = random.normal(0.0, 0.3, len(data.action))
      data.action[:, 1] = random.normal(0.2, 0.03, len(data.action))
    agent = build(
      LfgpConfig(
        bc_warm_start_updates=1000,
        bc_loss="likelihood",
        bc_learning_rate=3e-3,
        hidden_size=16,
        batch_size=64,
      ),
      TASKS,
      shown,
      synthetic.ArrayReplay(synthetic.transitions(200, OBS, A)),
      0,
      "cpu",
      OBS,
      A,
    )
    agent.prepare()
    rows = torch.from_numpy(shown["stack"].observation)
    _, deviation = agent.learner.networks.intentions(rows)
    coarse, fine = deviation.mean((0, 1)).tolist()
    self.assertBetween(coarse, 0.2, 0.6)
    self.assertBetween(fine, 0.01, 0.1)

  @parameterized.parameters("squared_error", "likelihood")
  def test_a_prior_keeps_intentions_near_their_start_on_replayed_rows(
    self, bc_loss
  ):
    distances = []
    for weight in (1e-6, 100.0):
      agent = _build(
        actor_trunk="own",
        prior_weight=weight,
        bc_loss=bc_loss,
        bc_warm_start_updates=5,
        intention_learning_rate=1e-2,
      )
      agent.prepare()
      rows = torch.from_numpy(synthetic.transitions(50, OBS, A).observation)
      start = agent.learner.networks.intentions(rows)[0].tanh()
      for _ in range(50):
        agent.update()
      now = agent.learner.networks.intentions(rows)[0].tanh()
      distances.append((now - start).square().sum(-1).mean().item())
      state = agent.state_dict()["learner"]["networks"]["prior"]
      self.assertIn("trunk.first.weight", state)  # a resume needs it
    self.assertLess(distances[1], 0.2 * distances[0])


class InitFromTest(parameterized.TestCase):
  @parameterized.parameters("shared_trunk", "separate")
  def test_intentions_of_common_tasks_act_like_the_policy(self, layout):
    source = _build(("reach", "bring"), 1, standardise=True, layout=layout)
    policy = source.policy
    agent = _build(init_from="a folder", standardise=True, layout=layout)
    rows = synthetic.transitions(5, OBS, A).observation
    before = agent.policy.act(rows, "stack")
    agent.start_from(policy)
    np.testing.assert_array_equal(
      agent.policy.act(rows, "reach"), policy.act(rows, "reach")
    )
    self.assertFalse(np.array_equal(agent.policy.act(rows, "stack"), before))
    networks = agent.learner.networks
    self.assertTrue(networks.intentions.owns_trunk)
    self.assertIsNot(networks.intentions.trunk, networks.critics.trunk)
    for critics in (networks.critics, networks.target_critics):
      torch.testing.assert_close(
        _states(critics.trunk), _states(networks.intentions.trunk)
      )
    agent.prepare()
    agent.update()

  def test_other_sizes_and_tasks_are_refused(self):
    agent = _build(init_from="a folder")
    with self.assertRaisesRegex(ValueError, "the policy has none of stack"):
      agent.start_from(_build(("bring",)).policy)
    with self.assertRaisesRegex(ValueError, "the policy: .*has shape"):
      agent.start_from(_build(hidden_size=8).policy)


class AbsorbingFlagTest(absltest.TestCase):
  def test_every_network_sees_one_more_input_that_is_0(self):
    agent = _build(absorbing_flag=True, fine_scale=0.1, standardise=True)
    networks = agent.learner.networks
    self.assertEqual(networks.critics.trunk.first.in_features, 2 * OBS + 1)
    discriminator = networks.discriminator
    self.assertEqual(discriminator.first.in_features, 2 * OBS + 1 + A)
    draw = agent.batches.draw(0)
    self.assertEqual(draw.batch.inputs.shape, (32, 2 * OBS + 1))
    self.assertTrue((draw.batch.inputs[:, -1] == 0).all())
    self.assertTrue((draw.expert.inputs[..., -1] == 0).all())
    agent.update()

  def test_a_stored_policy_remembers_it(self):
    agent = _build(absorbing_flag=True)
    options = agent.policy_options()
    self.assertEqual(options["observation_size"], OBS)
    stored = Policy.from_arrays(agent.policy_arrays(), options)
    rows = synthetic.transitions(5, OBS, A).observation
    np.testing.assert_array_equal(
      stored.act(rows, "lift"), agent.policy.act(rows, "lift")
    )


class KeptSuccessTest(absltest.TestCase):
  """A thousand updates after the warm start: success is not lost."""

  def test_success_of_cloning_is_kept(self):
    torch.set_num_threads(1)
    plan = Plan(
      lambda task: toy.PointEnvironment(),
      toy.WalkingActor,
      "right",
      toy.TASKS,
      seed=1,
    )
    shown = collection.collect(plan, "reset", toy.TASKS, 200, progress=False)
    config = LfgpConfig(
      hidden_size=32,
      batch_size=32,
      discriminator_batch_size=32,
      episode_steps=20,
      xi=5,
      random_steps=0,
      warm_up=100,
      intention_learning_rate=3e-4,
      initial_temperature=0.01,
      bc_warm_start_updates=200,
      bc_learning_rate=3e-3,
      bc_weight=10.0,
    )
    environment = toy.PointEnvironment()
    widths = environments.widths(environment)
    replay = Replay(1200, *widths)
    agent = build(
      config,
      toy.TASKS,
      {task: part.demonstrations for task, part in shown.items()},
      replay,
      0,
      "cpu",
      *widths,
    )
    agent.prepare()
    before, apart = self._success(agent), _distance(agent, shown)
    self.assertEqual(before, {"right": 1.0, "left": 1.0})
    log = metrics.MetricsLog(self.create_tempdir().full_path)
    schedule = TrainSchedule(
      env_steps=1100, warmup_steps=100, progress_bar=False
    )
    loop.train(environment, agent, replay, schedule, log)
    self.assertEqual(agent.updates, 1001)
    self.assertEqual(self._success(agent), before)
    self.assertLess(_distance(agent, shown), 1.2 * apart)  # without BC: 8 x

  def _success(self, agent):
    rows = evaluation.evaluate(
      toy.PointEnvironment,
      lambda: agent.policy,
      toy.TASKS,
      episodes=10,
      seed=0,
      progress=False,
    )
    return evaluation_csv.success_rates(rows)


class PrecisePriorTest(absltest.TestCase):
  def test_too_high_a_target_entropy_is_told_of_by_task(self):
    fields = {"bc_loss": "likelihood", "prior_weight": 0.1}
    for deviation, tasks in ((0.01, list(TASKS)), (1.0, [])):
      agent = _build(target_entropy=-2.0, actor_trunk="own", **fields)
      agent.learner.networks.intentions.heads.set_deviation(deviation)
      with mock.patch.object(logging, "warning") as warning:
        agent.prepare()
      self.assertEqual([call.args[1] for call in warning.mock_calls], tasks)

  def test_a_prior_without_demonstrations_is_not_asked_for_its_entropy(self):
    rows = synthetic.transitions(50, OBS, A)
    rewards = np.zeros((50, len(TASKS)), np.float32)
    agent = build(
      LfgpConfig(
        reward_source="replay",
        bc_loss="likelihood",
        prior_weight=0.1,
        hidden_size=16,
      ),
      TASKS,
      {},
      synthetic.ArrayReplay(rows, rewards, TASKS),
      0,
      "cpu",
      OBS,
      A,
    )
    agent.prepare()
    agent.update()
    self.assertIn("distance_from_prior/stack", agent.metrics())

  def test_entropy_by_hand(self):
    agent = _build()
    network = agent.learner.networks.intentions
    network.heads.set_deviation(0.01)
    with torch.no_grad():
      network.heads.output.weight[..., :A] = 0.0
      network.heads.output.bias[..., :A] = 0.0
    found = entropies(
      network, torch.zeros(len(TASKS), 20_000, OBS), torch.Generator()
    )
    # A Gaussian's, 0.5 ln(2 pi e) + ln 0.01 a float; the tanh is straight here.
    by_hand = A * (1.418939 - 4.605170)
    np.testing.assert_allclose(found, by_hand, atol=0.02)


if __name__ == "__main__":
  absltest.main()
