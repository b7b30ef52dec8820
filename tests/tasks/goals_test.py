"""Conditions and dense rewards, against values worked out by hand."""

import dataclasses
import math

from absl.testing import parameterized

from lfgp_dmc.tasks import workspace as ws
from lfgp_dmc.tasks.goals import GOALS, terms
from lfgp_dmc.tasks.snapshot import Snapshot

# Blue flat at the tray's centre, green 10 cm to its left, the hand 5 cm above.
_REST = Snapshot(
  tcp=(0.0, 0.5, 0.195),
  tcp_speed=0.0,
  fingers=(1.0, 1.0),
  blue=(0.0, 0.5, 0.145),
  green=(-0.1, 0.5, 0.145),
  blue_speed=0.0,
  blue_acceleration=0.0,
  blue_on_green=False,
  blue_on_tray=True,
  blue_on_robot=False,
  action=(0.0, 0.0, 0.0, 0.0),
)


def state(**changes) -> Snapshot:
  return dataclasses.replace(_REST, **changes)


_ON_GREEN = {"blue_on_green": True, "blue_on_tray": False}
_IN_ZONE = {"blue": (0.075, 0.5, 0.145)}
_CLOSES = {"action": (0, 0, 0, 0.5)}


class ConditionsTest(parameterized.TestCase):
  @parameterized.named_parameters(
    ("rest_is_no_stack", "stack", {}, False),
    ("on_green_alone", "stack", _ON_GREEN, True),
    ("leaning", "stack", {"blue_on_green": True}, False),
    ("held_on_green", "stack", {**_ON_GREEN, "blue_on_robot": True}, False),
    ("unstack_stack_is_stack", "unstack_stack", _ON_GREEN, True),
    # 1 cm of the 3 cm is height for a flat block: 2.82 cm are left.
    ("bring_inside", "bring", {"blue": (0.075, 0.5281, 0.145)}, True),
    ("bring_outside", "bring", {"blue": (0.075, 0.5284, 0.145)}, False),
    ("bring_held", "bring", {**_IN_ZONE, "blue_on_robot": True}, False),
    ("bring_in_the_air", "bring", {**_IN_ZONE, "blue_on_tray": False}, False),
    ("insert_in", "insert", {"blue": (0.0774, 0.5, 0.135)}, True),
    ("insert_off", "insert", {"blue": (0.0776, 0.5, 0.135)}, False),
    ("insert_flat_over_the_slot", "insert", _IN_ZONE, False),
    ("opens", "open_gripper", {"action": (0, 0, 0, -0.01)}, True),
    ("does_not_open_at_0", "open_gripper", {}, False),
    ("closing_is_no_opening", "open_gripper", _CLOSES, False),
    ("closes", "close_gripper", _CLOSES, True),
    (
      "near_green",
      "close_gripper",
      {**_CLOSES, "tcp": (-0.15, 0.5, 0.2)},
      True,
    ),
    ("far_away", "close_gripper", {**_CLOSES, "tcp": (0.0, 0.5, 0.246)}, False),
    ("too_fast", "close_gripper", {**_CLOSES, "tcp_speed": 0.081}, False),
    ("reached", "reach", {"tcp": (0.0, 0.5149, 0.145)}, True),
    ("not_reached", "reach", {"tcp": (0.0, 0.5151, 0.145)}, False),
    ("lifted", "lift", {"blue": (0.0, 0.5, 0.2051)}, True),
    ("not_lifted", "lift", {"blue": (0.0, 0.5, 0.2049)}, False),
    ("moves", "move_object", {"blue_speed": 0.051}, True),
    ("too_slow", "move_object", {"blue_speed": 0.049}, False),
    (
      "jerks",
      "move_object",
      {"blue_speed": 0.1, "blue_acceleration": 5.1},
      False,
    ),
  )
  def test_condition(self, task, changes, expected):
    self.assertIs(GOALS[task].condition(state(**changes)), expected)

  def test_holds_are_half_a_second_and_a_second_for_move_object(self):
    checks = {name: goal.hold_checks for name, goal in GOALS.items()}
    self.assertEqual(checks.pop("move_object"), 20)
    self.assertEqual(set(checks.values()), {10})


class RewardsTest(parameterized.TestCase):
  def total(self, task, **changes) -> float:
    return sum(GOALS[task].dense_terms(state(**changes)).values())

  def test_reach_is_1_minus_tanh_of_10_d(self):
    self.assertAlmostEqual(self.total("reach"), 1 - math.tanh(0.5))

  def test_limits_cost_a_tenth_of_the_push_outwards(self):
    # At the +x face, pushing out by 0.5; at the floor, pushing down by 1.
    at_edge = state(tcp=(0.148, 0.5, 0.147), action=(0.5, 0.0, -1.0, 0.0))
    self.assertAlmostEqual(terms.limits(at_edge), -0.15)
    inwards = dataclasses.replace(at_edge, action=(-1.0, 0.0, 1.0, 0.0))
    self.assertEqual(terms.limits(inwards), 0.0)

  def test_open_is_1_less_half_the_movement_near_a_block(self):
    opens = {"action": (0.3, 0.4, 0.0, -1.0)}
    self.assertAlmostEqual(self.total("open_gripper", **opens), 0.75)
    far = self.total("open_gripper", tcp=(0.0, 0.6, 0.28), **opens)
    self.assertEqual(far, 0.0)

  def test_close_with_the_wrong_sign_pays_for_the_movement_alone(self):
    total = self.total("close_gripper", action=(0.0, 0.6, 0.0, -1.0))
    self.assertAlmostEqual(total, -0.3)

  def test_lift_pays_height_near_and_grasp(self):
    # Gripped 4 cm up: 0.04 / 0.08 + 0.1 + 0.3. Open fingers: neither height nor
    # grasp. 9 cm up: 1.5 + 0.1 + 0.3.
    for z, opening, expected in (
      (0.185, 0.5, 0.9),
      (0.185, 1.0, 0.1),
      (0.235, 0.5, 1.9),
    ):
      at = {"blue": (0.0, 0.5, z), "tcp": (0.0, 0.5, z)}
      total = self.total("lift", fingers=(opening, opening), **at)
      self.assertAlmostEqual(total, expected)

  def test_move_object_pays_speed_and_carrying_less_jerk(self):
    # 5 x 0.1 + near 0.1 + carried 0.1 - 0.1 x min(3, 1.5).
    total = self.total(
      "move_object",
      tcp=(0.0, 0.5, 0.165),
      blue=(0.0, 0.5, 0.165),
      fingers=(0.5, 0.5),
      blue_speed=0.1,
      blue_acceleration=3.0,
    )
    self.assertAlmostEqual(total, 0.55)

  def test_bring_pays_closeness_then_letting_go(self):
    total = self.total("bring", blue=(0.035, 0.53, 0.145), tcp=(0, 0.5, 0.145))
    self.assertAlmostEqual(total, 1 - math.tanh(0.5))  # 5 cm to go
    # At the goal, opening, 2 cm away: 1.5 + 0.3 x 0.5.
    above = {"tcp": (0.075, 0.5, 0.165), "action": (0, 0, 0, -1.0)}
    self.assertAlmostEqual(self.total("bring", **_IN_ZONE, **above), 1.65)

  def test_insert_wants_a_millimetre(self):
    almost = self.total("insert", **_IN_ZONE, tcp=(0.075, 0.5, 0.145))
    self.assertAlmostEqual(almost, 1 - math.tanh(0.1))

  def test_stack_pays_placing_retreat_lift_and_opening(self):
    # 41 mm above green, 2 cm from the hand, still, opening by 0.5.
    total = self.total(
      "stack",
      blue=(-0.1, 0.5, 0.186),
      tcp=(-0.1, 0.5, 0.206),
      fingers=(0.5, 0.5),
      action=(0.0, 0.0, 0.0, -0.5),
    )
    # place 1.5, retreat 0.5, lift 0.2, no grasp at 2 cm, open 1.5.
    self.assertAlmostEqual(total, 3.7)
    self.assertEqual(self.total("stack", tcp=(0.0, 0.5, 0.246)), 0.0)

  def test_stack_lift_term_rises_to_35_mm_and_not_to_7(self):
    held = {"fingers": (0.5, 0.5), "tcp": (0.0, 0.5, 0.165)}
    goal = GOALS["stack"]
    at_14 = goal.dense_terms(state(blue=(0.0, 0.5, 0.159), **held))["lift"]
    self.assertAlmostEqual(at_14, 0.2 * 0.014 / 0.035)

  def test_off_tray_penalty_is_for_a_green_block_1_mm_off(self):
    self.assertEqual(terms.off_tray_penalty(_REST), 0.0)
    raised = state(green=(-0.1, 0.5, ws.STACKED_Z))
    self.assertEqual(terms.off_tray_penalty(raised), -0.1)
