"""Pretraining by cloning, and whether it is kept."""

from unittest import mock

import numpy as np
import torch
from absl import logging
from absl.testing import absltest, parameterized

from lfgp_dmc import toy
from lfgp_dmc.acting import collection
from lfgp_dmc.acting.attempts import CollectionPlan
from lfgp_dmc.agents import optimisation, synthetic
from lfgp_dmc.agents.lfgp.prior import entropies
from lfgp_dmc.data import evaluation_csv
from tests.agents import fixtures
from tests.agents.fixtures import OBS, TASKS, A, make_agent, states

_OWN = {"networks.actor_trunk": "own"}
_PRIOR = {"prior.distance": "divergence", "prior.weight": 0.1}


class PretrainingTest(parameterized.TestCase):
  @parameterized.parameters("shared_trunk", "separate")
  def test_imitates_without_an_update(self, layout):
    cloning = {"pretraining.learning_rate": 3e-3, "pretraining.updates": 300}
    agent = make_agent(**_OWN, **cloning, **{"networks.layout": layout})
    part = fixtures.demonstrations()["reach"]

    def error():
      acts = agent.policy.act(part.observation, "reach")
      return np.square(acts - part.action).mean()

    before = error()
    agent.prepare()
    self.assertLess(error(), 0.2 * before)
    self.assertEqual(agent.learner.updates, 0)

  def test_intentions_and_temperatures_wait_for_the_critics(self):
    rate = {"intention.learning_rate": 1e-3}
    agent = make_agent(**rate, **{"critic.warmup_updates": 2})
    networks = agent.learner.networks
    heads = states(networks.intentions.heads)
    critics = states(networks.critics)
    fixtures.train(agent, 2)
    self.assertEmpty(fixtures.moved(heads, networks.intentions.heads))
    self.assertEqual(networks.log_temperature.tolist(), [0.0] * len(TASKS))
    self.assertIn("heads.bias", fixtures.moved(critics, networks.critics))
    agent.update()
    moved = fixtures.moved(heads, networks.intentions.heads)
    self.assertIn("output.bias", moved)
    self.assertNotEqual(networks.log_temperature[0].item(), 0.0)

  def test_cloned_intentions_get_the_std_of_the_config(self):
    cloning = {"pretraining.updates": 1, "pretraining.std": 0.1}
    agent = make_agent(**_OWN, **cloning)
    agent.prepare()
    _, std = agent.learner.networks.intentions(torch.randn(7, OBS))
    torch.testing.assert_close(std, torch.full_like(std, 0.1))

  def test_the_step_falls_to_0_by_a_half_cosine(self):
    cloning = {"pretraining.updates": 3, "pretraining.learning_rate": 4e-3}
    agent, rates = make_agent(**_OWN, **cloning), []
    step = lambda adam, _: rates.append(adam.learning_rate)  # noqa: E731
    with mock.patch.object(optimisation.Adam, "step", step):
      agent.prepare()
    # Shares 0.5 (1 + cos 0), 0.5 (1 + cos 60), 0.5 (1 + cos 120).
    np.testing.assert_allclose(rates, [4e-3, 3e-3, 1e-3])

  def test_likelihood_learns_how_precise_the_expert_is(self):
    shown = fixtures.demonstrations()
    random = np.random.default_rng(0)
    for data in shown.values():  # the second action precise, the first not
      data.action[:, 0] = random.normal(0.0, 0.3, len(data.action))
      data.action[:, 1] = random.normal(0.2, 0.03, len(data.action))
    agent = make_agent(
      shown=shown,
      **{
        **_OWN,
        "batch_size": 64,
        "pretraining.learning_rate": 3e-3,
        "pretraining.loss": "likelihood",
        "pretraining.updates": 1000,
      },
    )
    agent.prepare()
    rows = torch.from_numpy(shown["stack"].observation)
    _, std = agent.learner.networks.intentions(rows)
    coarse, fine = std.mean((0, 1)).tolist()
    self.assertBetween(coarse, 0.2, 0.6)
    self.assertBetween(fine, 0.01, 0.1)


class PriorTest(parameterized.TestCase):
  @parameterized.parameters("squared_error", "divergence")
  def test_keeps_intentions_near_their_start_on_replayed_rows(self, distance):
    distances = []
    for weight in (1e-6, 100.0):
      prior = {"prior.distance": distance, "prior.weight": weight}
      agent = make_agent(**_OWN, **prior, **{"intention.learning_rate": 1e-2})
      agent.prepare()
      rows = fixtures.batch(50).inputs
      start = agent.learner.networks.intentions(rows)[0].tanh()
      fixtures.train(agent, 50)
      now = agent.learner.networks.intentions(rows)[0].tanh()
      distances.append((now - start).square().sum(-1).mean().item())
      state = agent.state_dict()["learner"]["networks"]["prior"]
      self.assertIn("trunk.first.weight", state)  # a resume needs it
    self.assertLess(distances[1], 0.2 * distances[0])

  @parameterized.product(
    bfloat16=(False, True), distance=("squared_error", "divergence")
  )
  def test_the_first_update_is_at_no_distance(self, bfloat16, distance):
    cloning = {"pretraining.updates": 3, "pretraining.std": 0.1}
    prior = {**_PRIOR, "prior.distance": distance}
    agent = make_agent(bfloat16=bfloat16, **_OWN, **prior, **cloning)
    agent.prepare()
    metrics = fixtures.train(agent, 1)
    for task in TASKS:
      found = metrics[f"distance_from_prior/{task}"]
      self.assertAlmostEqual(found, 0.0, places=6)

  def test_the_weight_decays_and_counts_in_values(self):
    agent = make_agent(
      **{"prior.weight": 2.0, "prior.decay": 0.5, "prior.normalise": True}
    )
    prior = agent.learner.prior
    inputs = torch.zeros(4, OBS)
    mean, std = torch.ones(2, len(TASKS), 4, A)
    q = torch.tensor([-3.0, -5.0])[:, None, None].expand(2, len(TASKS), 4)
    losses = []
    for updates in (0, 1, 2):
      prior.fade(updates)
      loss, found = prior(inputs, mean, std, q)
      losses.append(loss.item())
    by_hand = 2.0 * 5.0 * found["distance_from_prior"].sum().item()
    expected = [by_hand, by_hand / 2, by_hand / 4]
    np.testing.assert_allclose(losses, expected, rtol=1e-5)

  def test_too_high_a_target_entropy_is_reported_by_task(self):
    for std, tasks in ((0.01, list(TASKS)), (1.0, [])):
      agent = make_agent(**_PRIOR, **{"intention.target_entropy": -2.0})
      agent.learner.networks.intentions.heads.set_std(std)
      with mock.patch.object(logging, "warning") as warning:
        agent.prepare()
      self.assertEqual([call.args[1] for call in warning.mock_calls], tasks)

  def test_works_without_demonstrations(self):
    rows = synthetic.transitions(50, OBS, A)
    rewards = np.zeros((50, len(TASKS)), np.float32)
    replay = synthetic.replay(rows, rewards, TASKS)
    stored = {"reward.kind": "stored", **_PRIOR}
    agent = make_agent(shown={}, replay=replay, **stored)
    agent.prepare()
    metrics = fixtures.train(agent, 1)
    self.assertTrue(np.isfinite(metrics["distance_from_prior/stack"]))

  def test_entropy_by_hand(self):
    network = make_agent().learner.networks.intentions
    network.heads.set_std(0.01)
    with torch.no_grad():
      network.heads.output.weight[..., :A] = 0.0
      network.heads.output.bias[..., :A] = 0.0
    rows = torch.zeros(len(TASKS), 20_000, OBS)
    found = entropies(network, rows, torch.Generator())
    # A Gaussian's, 0.5 ln(2 pi e) + ln 0.01 a float; the tanh is straight here.
    by_hand = A * (1.418939 - 4.605170)
    np.testing.assert_allclose(found, by_hand, atol=0.02)


class KeptSuccessTest(absltest.TestCase):
  """A thousand updates after pretraining: success is not lost."""

  def test_success_of_cloning_is_kept(self):
    make = (lambda task: toy.PointEnvironment(), toy.WalkingActor)
    plan = CollectionPlan(*make, "right", toy.TASKS, seed=1)
    shown = collection.collect(plan, "reset", toy.TASKS, 200, progress=False)
    shown = {task: part.demonstrations for task, part in shown.items()}
    agent, replay = fixtures.make_toy_agent(
      0,
      1200,
      shown,
      **{
        **_OWN,
        "intention.initial_temperature": 0.01,
        "intention.learning_rate": 3e-4,
        "pretraining.learning_rate": 3e-3,
        "pretraining.updates": 200,
        "prior.weight": 10.0,
        "scheduler.xi": 5,
      },
    )
    agent.prepare()
    apart = _distance(agent, shown)
    self._check_succeeds(agent)
    folder = self.create_tempdir().full_path
    fixtures.train_on_toy(agent, replay, 1100, folder)
    self.assertEqual(agent.learner.updates, 1001)
    self._check_succeeds(agent)
    self.assertLess(_distance(agent, shown), 1.2 * apart)

  def _check_succeeds(self, agent):
    rows = fixtures.evaluate_on_toy(agent, 10)
    found = evaluation_csv.success_rates(rows)
    self.assertEqual(found, {"right": 1.0, "left": 1.0})


def _distance(agent, shown):
  """The mean distance of actions from the demonstrated ones."""
  squares = [
    np.square(agent.policy.act(data.observation, task) - data.action).sum(1)
    for task, data in shown.items()
  ]
  return float(np.sqrt(np.mean(squares)))
