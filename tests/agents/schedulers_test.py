"""Schedulers: worked examples, published tables, state."""

import math

import numpy as np
from absl.testing import absltest, parameterized

from lfgp_dmc import task_names
from lfgp_dmc.agents import schedulers
from lfgp_dmc.agents.schedulers import conditional, handcrafted
from lfgp_dmc.agents.schedulers.config import QTableConfig
from lfgp_dmc.agents.schedulers.q_table import QTable
from tests.agents import fixtures

NAMES = (
  "q_table",
  "weighted_random",
  "weighted_random_handcrafted",
  "conditional_weighted",
  "main_only",
  "uniform",
)


STACK = task_names.task_set("stack")


class _Scripted:
  """Stands in for a generator: `choice` follows a script."""

  def __init__(self, choices):
    self._choices = iter(choices)

  def choice(self, size, p):
    del size, p
    return next(self._choices)


def _table(tasks, generator, **fields):
  return QTable(tasks, generator, QTableConfig(**fields))


def _make(name, tasks=STACK, seed=0, **fields):
  fields = {f"scheduler.{k}": v for k, v in fields.items()}
  config = fixtures.config(**{"scheduler.kind": name, **fields}).scheduler
  return schedulers.make_scheduler(config, tasks, np.random.default_rng(seed))


class PeriodReturnsTest(absltest.TestCase):
  def test_discount_restarts_at_each_period_and_the_last_may_be_short(self):
    returns = schedulers.period_returns(np.array([1.0, 2, 3, 4, 5]), 2, 0.5)
    # 1 + 2/2 + 3/4 + 4/8 + 5/16, 3 + 4/2 + 5/4 and 5.
    self.assertEqual(returns.tolist(), [3.5625, 6.25, 5.0])


class QTableTest(absltest.TestCase):
  def _play(self, table, returns):
    table.begin_episode()
    for _ in returns:
      table.next_task()
    table.end_episode(returns)
    table.begin_episode()
    return table

  def test_moving_average_over_all_prefixes(self):
    table = _table(2, _Scripted([0, 1, 0, 0]), phi=0.6)
    self._play(table, [10.0, 20.0])
    self.assertAlmostEqual(table.value([0]), 6.0)
    self.assertAlmostEqual(table.value([0, 1]), 12.0)
    self._play(table, [5.0, 1.0])
    self.assertAlmostEqual(table.value([0]), 0.4 * 6 + 0.6 * 5)
    self.assertAlmostEqual(table.value([0, 0]), 0.6)
    self.assertAlmostEqual(table.value([0, 1]), 12.0)
    self.assertEqual(table.value([1]), 0.0)

  def test_boltzmann_probabilities(self):
    table = _table(3, _Scripted([1]), phi=1.0, temperature=2.0, decay=1.0)
    found = self._play(table, [2 * math.log(4)]).probabilities()
    # exp(Q / T) = 1, 4, 1.
    np.testing.assert_allclose(found, [1 / 6, 4 / 6, 1 / 6])

  def test_huge_values_do_not_overflow(self):
    table = _table(2, _Scripted([0]), phi=1.0, temperature=0.1)
    found = self._play(table, [1e6]).probabilities()
    np.testing.assert_allclose(found, [1.0, 0.0])

  def test_temperature_falls_at_every_choice_down_to_the_minimum(self):
    cooling = {"temperature": 360, "decay": 0.5, "minimum": 100}
    table = _table(2, np.random.default_rng(0), **cooling)
    table.begin_episode()
    seen = []
    for _ in range(3):
      table.next_task()
      seen.append(table.temperature)
    self.assertEqual(seen, [180, 100, 100])

  def test_a_state_holds_values_and_temperature(self):
    table = _table(2, _Scripted([0, 1]), phi=0.5, temperature=8, decay=0.5)
    other = _table(2, np.random.default_rng(0))
    table._generator.bit_generator = other._generator.bit_generator
    self._play(table, [10.0, 20.0])
    other.load_state_dict(fixtures.reloaded(table.state_dict()))
    self.assertEqual(other.temperature, 2.0)
    self.assertEqual([other.value([0]), other.value([0, 1])], [5.0, 10.0])
    self.assertEqual(other.value([1]), 0.0)

  def test_equals_a_table_of_whole_histories(self):
    random, expected = np.random.default_rng(1), {}
    choices = random.integers(3, size=(40, 4))
    table = _table(3, _Scripted(choices.ravel()), phi=0.3)
    for row in choices.tolist():
      returns = random.normal(size=4)
      self._play(table, returns)
      for length, main_return in enumerate(returns, 1):
        history = tuple(row[:length])
        before = expected.get(history, 0.0)
        expected[history] = (1 - 0.3) * before + 0.3 * main_return
    restored = _table(3, np.random.default_rng(0))
    table._generator.bit_generator = restored._generator.bit_generator
    state = fixtures.reloaded(table.state_dict())
    restored.load_state_dict(state)
    self.assertLen(state["values"], len(expected))
    for history, value in expected.items():
      self.assertAlmostEqual(table.value(history), value)
      self.assertEqual(restored.value(history), table.value(history))

  def test_returns_must_match_the_choices(self):
    table = _table(2, np.random.default_rng(0))
    table.begin_episode()
    table.next_task()
    with self.assertRaisesRegex(ValueError, "2 returns for 1 choices"):
      table.end_episode([1.0, 2.0])


class ConditionalTest(parameterized.TestCase):
  @parameterized.parameters(*conditional.TABLES)
  def test_rows_sum_to_one(self, main):
    table = conditional.table_for(task_names.task_set(main))
    np.testing.assert_allclose(table.sum(1), 1.0)
    self.assertTrue((table >= 0).all())

  @parameterized.parameters(
    ("stack", "reset", "lift", 1 / 6),
    ("stack", "stack", "open_gripper", 0.4),
    ("stack", "lift", "move_object", 0.25),
    ("stack", "open_gripper", "lift", 1 / 6),
    ("bring", "reach", "close_gripper", 0.125),
    ("insert", "reset", "bring", 0.125),
    ("insert", "bring", "insert", 0.8),
    ("insert", "insert", "open_gripper", 0.4),
    ("insert", "insert", "reach", 0.05),
    ("insert", "lift", "reach", 0.0),
    ("insert", "reach", "close_gripper", 0.1),
    # The extra task's .35 dropped: .1 / .65.
    ("unstack_stack", "reset", "reach", 10 / 65),
    # The extra task's .5, 1/6, .2 and .125 dropped.
    ("move_object", "reset", "open_gripper", 0.25),
    ("move_object", "open_gripper", "move_object", 0.6),
    ("move_object", "lift", "move_object", 0.75),
    ("move_object", "reach", "move_object", 0.5 / 0.875),
    ("move_object", "move_object", "lift", 0.6),
  )
  def test_published_entries(self, main, last, following, expected):
    tasks = task_names.task_set(main)
    row = len(tasks) if last == "reset" else tasks.index(last)
    table = conditional.table_for(tasks)
    self.assertAlmostEqual(table[row, tasks.index(following)], expected)

  def test_uses_the_row_of_the_last_choice(self):
    table = conditional.table_for(STACK)
    scheduler = _make("conditional_weighted")
    for _ in range(2):
      scheduler.begin_episode()
      np.testing.assert_array_equal(scheduler.probabilities(), table[-1])
      chosen = scheduler.next_task()
      np.testing.assert_array_equal(scheduler.probabilities(), table[chosen])

  def test_unknown_main_task_is_refused_with_the_valid_ones(self):
    with self.assertRaisesRegex(ValueError, "'reach'; valid: stack"):
      conditional.table_for(("reach",))


class FactoryTest(parameterized.TestCase):
  @parameterized.product(
    name=NAMES, main=(*task_names.MAIN_TASKS, "move_object")
  )
  def test_same_seed_same_choices_and_state_round_trip(self, name, main):
    tasks = task_names.task_set(main)
    first, second = _make(name, tasks), _make(name, tasks)
    self.assertEqual(_play(first), _play(second))
    third = _make(name, tasks, seed=7)
    third.load_state_dict(fixtures.reloaded(first.state_dict()))
    self.assertEqual(_play(first), _play(third))

  @parameterized.parameters(
    ("weighted_random", [0.5, 0.1, 0.1, 0.1, 0.1, 0.1]),
    ("main_only", [1, 0, 0, 0, 0, 0]),
    ("uniform", [1 / 6] * 6),
    ("q_table", [1 / 6] * 6),
  )
  def test_first_probabilities(self, name, expected):
    scheduler = _make(name)
    scheduler.begin_episode()
    np.testing.assert_allclose(scheduler.probabilities(), expected)

  @parameterized.parameters("weighted_random", "weighted_random_handcrafted")
  def test_the_main_tasks_weight_is_the_configs(self, name):
    found = _make(name, main_weight=0.75).probabilities()
    np.testing.assert_allclose(found, [0.75, 0.05, 0.05, 0.05, 0.05, 0.05])

  def test_single_task_is_always_chosen(self):
    for name in ("q_table", "weighted_random", "main_only", "uniform"):
      scheduler = _make(name, ("a",))
      scheduler.begin_episode()
      self.assertEqual(scheduler.next_task(), 0)


class HandcraftedTest(parameterized.TestCase):
  @parameterized.parameters(
    ("bring", 5, "bring open_gripper " * 4),
    ("stack", 5, "reach lift stack open_gripper reach lift stack open_gripper"),
    (
      "insert",
      7,
      "bring insert open_gripper bring insert open_gripper bring insert",
    ),
  )
  def test_published_sequences(self, main, count, one):
    tasks = task_names.task_set(main)
    sequences = handcrafted.sequences_for(tasks)
    self.assertLen(sequences, count)
    self.assertEqual({len(sequence) for sequence in sequences}, {8})
    self.assertIn(tuple(map(tasks.index, one.split())), sequences)

  def test_half_of_the_episodes_follow_a_sequence(self):
    sequences = handcrafted.sequences_for(STACK)
    played = _play(_make("weighted_random_handcrafted"), 400)
    followed = sum(tuple(episode) in sequences for episode in played)
    self.assertAlmostEqual(followed / 400, 0.5, delta=0.1)

  @parameterized.parameters((0.0, 0), (1.0, 50))
  def test_the_share_of_sequences_is_the_configs(self, probability, expected):
    sequences = handcrafted.sequences_for(STACK)
    name = "weighted_random_handcrafted"
    played = _play(_make(name, probability=probability), 50)
    followed = sum(tuple(episode) in sequences for episode in played)
    self.assertEqual(followed, expected)

  @parameterized.parameters(5, 12)
  def test_a_sequence_starts_with_the_episode_and_over_again(self, periods):
    sequences = handcrafted.sequences_for(STACK)
    wanted = {(one + one)[:periods] for one in sequences}
    scheduler = _make("weighted_random_handcrafted", probability=1.0)
    for _ in range(5):
      scheduler.begin_episode()
      chosen = tuple(scheduler.next_task() for _ in range(periods))
      self.assertIn(chosen, wanted)

  def test_missing_task_is_named(self):
    with self.assertRaisesRegex(ValueError, "needs lift, move_object, reach"):
      handcrafted.sequences_for(("stack", "open_gripper"))


def _play(scheduler, episodes=5):
  """Choices of eight periods an episode, with made-up returns."""
  played = []
  for number in range(episodes):
    scheduler.begin_episode()
    choices = [scheduler.next_task() for _ in range(8)]
    scheduler.end_episode([float(number - c) for c in choices])
    played.append(choices)
  return played
