"""Collection: exact counts, successes only, leads, the same for any workers."""

import dataclasses
from unittest import mock

import numpy as np
from absl.testing import absltest, parameterized

import lfgp_dmc
from lfgp_dmc import toy
from lfgp_dmc.acting import attempts, collection
from lfgp_dmc.acting.attempts import CollectionPlan, Collector
from lfgp_dmc.tasks import experts


class _PlayPoint(toy.PointEnvironment):
  """The toy world with what collection asks of an environment."""

  def clear_success(self):
    self._done = dict.fromkeys(toy.TASKS, False)


class _RightOnly(toy.WalkingActor):
  """Never gets to the left."""

  def begin(self, task, seed):
    super().begin("right", seed)


class _EverySecond(toy.WalkingActor):
  """Fails each second time, and fails the first."""

  _count = 0

  def begin(self, task, seed):
    self._count += 1
    super().begin(task if self._count % 2 == 0 else "left", seed)


class _Recorder(toy.WalkingActor):
  """Remembers what it was asked for."""

  def __init__(self):
    self.log = []

  def begin(self, task, seed):
    super().begin("right", seed)
    self.log.append([task, 0])

  def act(self, observation):
    self.log[-1][1] += 1
    return super().act(observation)


def _plan(make_actor=toy.WalkingActor, **options):
  options = {
    "make_environment": lambda task: _PlayPoint(),
    "make_actor": make_actor,
    "main_task": "right",
    "tasks": toy.TASKS,
    "seed": 5,
    "play_steps": 20,
    **options,
  }
  return CollectionPlan(**options)


def _collect(plan, kind="reset", tasks=toy.TASKS, pairs=50):
  return collection.collect(plan, kind, tasks, pairs, progress=False)


def _arrays(found):
  return {task: part.demonstrations.arrays() for task, part in found.items()}


class CollectTest(parameterized.TestCase):
  @parameterized.product(kind=("reset", "play"), pairs=(1, 50, 53))
  def test_exact_counts_and_whole_episodes(self, kind, pairs):
    found = _collect(_plan(), kind, pairs=pairs)
    self.assertEqual(list(found), list(toy.TASKS))
    for data in (part.demonstrations for part in found.values()):
      self.assertLen(data, pairs)
      ends = np.flatnonzero(np.diff(data.episode))
      np.testing.assert_array_equal(np.unique(np.diff(data.episode)[ends]),
                                    [1] if len(ends) else [])  # fmt: skip
      self.assertTrue(data.is_last[ends].all())
      self.assertEqual(data.is_last[:-1].sum(), len(ends))
      inside = ~data.is_last[:-1]
      np.testing.assert_array_equal(
        data.observation[1:][inside], data.next_observation[:-1][inside]
      )

  def test_of_several_attempts_the_longest_is_kept(self):
    one, three = Collector(_plan()), Collector(_plan(keep_longest_of=3))
    _, every = one(("right", range(30)))
    _, kept = three(("right", range(10)))
    lengths = [len(attempt.rows.action) for attempt in every]
    self.assertGreater(len(set(lengths)), 1)
    self.assertEqual(
      [len(attempt.rows.action) for attempt in kept],
      [max(lengths[i : i + 3]) for i in range(0, 30, 3)],
    )
    failing = Collector(_plan(_RightOnly, keep_longest_of=2))
    _, (failed,) = failing(("left", [0]))
    self.assertIsNone(failed.rows)

  @parameterized.parameters("reset", "play")
  def test_an_attempt_that_is_cut_has_no_last_row(self, kind):
    whole = _collect(_plan(), kind, pairs=50)["right"].demonstrations
    lengths = np.unique(whole.episode, return_counts=True)[1]
    end = int(lengths[:3].sum())
    exact = _collect(_plan(), kind, pairs=end)["right"].demonstrations
    cut = _collect(_plan(), kind, pairs=end - 1)["right"].demonstrations
    self.assertTrue(exact.is_last[-1])
    self.assertFalse(cut.is_last[-1])
    self.assertEqual(cut.is_last.sum(), 2)
    np.testing.assert_array_equal(cut.action, exact.action[:-1])

  @parameterized.parameters("reset", "play")
  def test_extra_finals_are_rows_of_success_of_further_attempts(self, kind):
    plain = _collect(_plan(), kind, pairs=20)
    found = collection.collect(
      _plan(), kind, toy.TASKS, 20, progress=False, finals=7
    )
    for task in toy.TASKS:
      data = found[task].demonstrations
      self.assertLen(data, 27)
      for name, array in plain[task].demonstrations.arrays().items():
        np.testing.assert_array_equal(data.arrays()[name][:20], array)
      self.assertTrue(data.is_last[20:].all())
      self.assertTrue((np.diff(data.episode[19:]) > 0).all())
      side = 1 if task == "right" else -1
      reached = side * data.next_observation[20:, 0]
      self.assertTrue((reached > 0.6).all())

  @parameterized.parameters("reset", "play")
  def test_whole_attempts_can_be_counted_instead(self, kind):
    plain = _arrays(_collect(_plan(), kind, pairs=90))
    found = collection.collect(
      _plan(), kind, toy.TASKS, 1, progress=False, attempts=7
    )
    for task in toy.TASKS:
      data = found[task].demonstrations
      self.assertEqual(data.attempts, 7)
      self.assertTrue(data.is_last[-1])
      self.assertLen(np.unique(data.episode), 7)
      for name, array in plain[task].items():
        np.testing.assert_array_equal(array[: len(data)], data.arrays()[name])

  @parameterized.parameters("reset", "play")
  def test_only_successes_are_kept(self, kind):
    found = _collect(_plan(), kind, ("right",), pairs=200)
    data = found["right"].demonstrations
    self.assertTrue((data.next_observation[data.is_last, 0] > 0.6).all())
    # Before success the point was never there: no failing step leaked in.
    self.assertTrue((data.next_observation[~data.is_last, 0] <= 0.6).all())
    self.assertTrue((data.action[:, 0] > 0.5).all())

  def test_a_task_that_never_succeeds_is_given_up(self):
    with self.assertRaisesRegex(collection.NoSuccessError, "left: 200 att"):
      _collect(_plan(_RightOnly), pairs=10)

  def test_only_failures_in_a_row_give_a_task_up(self):
    plan = _plan(_EverySecond, limits={"right": 10})
    with mock.patch.object(collection, "_MOST_FAILURES", 2):
      part = _collect(plan, tasks=("right",), pairs=30)["right"]
    self.assertGreater(part.successes, 4)
    self.assertEqual(part.attempts, 2 * part.successes)

  def test_play_draws_its_tasks(self):
    collector = Collector(_plan())
    firsts = [collector((None, [i]))[1][0].task for i in range(40)]
    self.assertBetween(firsts.count("right"), 10, 30)

  def test_play_is_reset_after_its_steps(self):
    for number in range(5):
      _, made = Collector(_plan(play_steps=10))((None, [number]))
      self.assertLessEqual(sum(len(one.rows.action) for one in made), 10)

  def test_what_a_reset_interrupts_is_no_failure(self):
    for part in _collect(_plan(), "play", pairs=60).values():
      self.assertEqual(part.attempts, part.successes)

  def test_each_attempt_at_play_has_noise_of_its_own(self):
    data = _collect(_plan(), "play", pairs=60)["right"].demonstrations
    firsts = data.action[np.unique(data.episode, return_index=True)[1]]
    self.assertLen(np.unique(firsts[:, 1]), len(firsts))

  @parameterized.parameters(
    (20, 90, 120, 150, 240), (10, 90, 120, 150, 180), (5, 45, 60, 75, 90)
  )
  def test_limits_have_twice_the_time_at_lower_rates(self, rate, *steps):
    plan = _plan(control_hz=rate, limits=attempts.LIMITS)
    tasks = ("lift", "unstack_stack", "bring", "insert")
    self.assertEqual([plan.limit(task) for task in tasks], list(steps))

  def test_failures_are_counted_and_broken_physics_dropped(self):
    plan = _plan(make_environment=lambda task: _PlayPoint(fail_every=2))
    plan = dataclasses.replace(plan, limits={"right": 4})
    part = _collect(plan, tasks=("right",), pairs=30)["right"]
    self.assertGreater(part.attempts, part.successes)
    lengths = np.unique(part.demonstrations.episode, return_counts=True)[1]
    self.assertLessEqual(lengths.max(), 4)

  def test_one_task_does_not_depend_on_the_others(self):
    both, alone = _collect(_plan()), _collect(_plan(), tasks=("left",))
    self._assert_same(_arrays(alone)["left"], _arrays(both)["left"])
    other = _collect(_plan(seed=6), tasks=("left",))
    self.assertFalse(
      np.array_equal(
        other["left"].demonstrations.action, alone["left"].demonstrations.action
      )
    )

  def test_unknown_names_list_the_valid_ones(self):
    with self.assertRaisesRegex(ValueError, "'film'; valid: reset, play"):
      _collect(_plan(), "film")
    with self.assertRaisesRegex(ValueError, "'up' is not .* right, left"):
      _collect(_plan(), tasks=("up",))

  @parameterized.parameters("reset", "play")
  def test_workers_change_nothing(self, kind):
    plan = CollectionPlan(
      lfgp_dmc.load,
      experts.ScriptedExpert,
      "stack",
      lfgp_dmc.task_set("stack"),
      seed=1,
      play_steps=120,
    )
    tasks = ("open_gripper", "reach")
    one, two = (
      collection.collect(plan, kind, tasks, 60, workers, progress=False)
      for workers in (1, 2)
    )
    for task in tasks:
      self.assertEqual(one[task][1:], two[task][1:])
      self._assert_same(_arrays(one)[task], _arrays(two)[task])

  def _assert_same(self, first, second):
    for name, array in first.items():
      np.testing.assert_array_equal(array, second[name], name)


class LeadTest(absltest.TestCase):
  """Open- and Close-Gripper; every attempt at them fails in the toy world."""

  _TASKS = ("right", "open_gripper", "close_gripper", "lift")

  def _run(self, task, numbers):
    """The actor's log of some attempts, (task, steps) each."""
    actor = _Recorder()
    plan = _plan(
      lambda: actor, make_environment=lambda task: _Long(), tasks=self._TASKS
    )
    _, attempts = Collector(plan)((task, numbers))
    return actor.log, attempts

  def test_close_stores_its_lead_of_lift(self):
    log, (attempt,) = self._run("close_gripper", range(1))
    self.assertEqual(log, [["lift", 15], ["close_gripper", 10]])
    self.assertLen(attempt.rows.action, 25)
    np.testing.assert_array_equal(
      attempt.rows.observation[1:], attempt.rows.next_observation[:-1]
    )

  def test_open_forgets_its_lead_a_quarter_of_them_the_main_task(self):
    log, attempts = self._run("open_gripper", range(200))
    leads = [task for task, steps in log[::2]]
    self.assertEqual({steps for _, steps in log[::2]}, {45})
    self.assertEqual({tuple(run) for run in log[1::2]}, {("open_gripper", 10)})
    self.assertLen(attempts[0].rows.action, 10)
    self.assertEqual(set(leads), {"right", "close_gripper", "lift"})
    self.assertBetween(leads.count("right") / len(leads), 0.15, 0.35)

  def test_other_tasks_have_no_lead(self):
    log, _ = self._run("lift", range(1))
    self.assertEqual([task for task, _ in log], ["lift"])


class _Long(_PlayPoint):
  """Every task succeeds ten steps after the last `clear_success`."""

  def reset(self):
    self._held = 0
    return super().reset()

  def clear_success(self):
    self._held = 0

  def step(self, action):
    self._held += 1
    self._steps = 0
    timestep = super().step(action)
    done = np.asarray(self._held >= 10)
    names = LeadTest._TASKS
    timestep.observation.update({f"success/{name}": done for name in names})
    return timestep
