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
_NEAR_GREEN = {"tcp": (-0.15, 0.5, 0.2)}
_JERKS = {"blue_speed": 0.1, "blue_acceleration": 5.1}


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
    ("near_green", "close_gripper", {**_CLOSES, **_NEAR_GREEN}, True),
    ("far_away", "close_gripper", {**_CLOSES, "tcp": (0.0, 0.5, 0.246)}, False),
    ("not_far", "close_gripper", {**_CLOSES, "tcp": (0.0, 0.5, 0.244)}, True),
    ("too_fast", "close_gripper", {**_CLOSES, "tcp_speed": 0.081}, False),
    ("slow_enough", "close_gripper", {**_CLOSES, "tcp_speed": 0.079}, True),
    ("reached", "reach", {"tcp": (0.0, 0.5149, 0.145)}, True),
    ("not_reached", "reach", {"tcp": (0.0, 0.5151, 0.145)}, False),
    ("lifted", "lift", {"blue": (0.0, 0.5, 0.2051)}, True),
    ("not_lifted", "lift", {"blue": (0.0, 0.5, 0.2049)}, False),
    ("moves", "move_object", {"blue_speed": 0.051}, True),
    ("too_slow", "move_object", {"blue_speed": 0.049}, False),
    ("jerks", "move_object", _JERKS, False),
    ("smooth", "move_object", {**_JERKS, "blue_acceleration": 4.9}, True),
  )
  def test_condition(self, task, changes, expected):
    self.assertIs(GOALS[task].condition(state(**changes)), expected)

  def test_holds_are_half_a_second_and_a_second_for_move_object(self):
    checks = {name: goal.hold_checks for name, goal in GOALS.items()}
    self.assertEqual(checks.pop("move_object"), 20)
    self.assertEqual(set(checks.values()), {10})


class RewardsTest(parameterized.TestCase):
  def check(self, task, expected, **changes):
    found = GOALS[task].dense_terms(state(**changes))
    self.assertAlmostEqual(sum(found.values()), expected)

  def test_reach_is_1_minus_tanh_of_10_d(self):
    self.check("reach", 1 - math.tanh(0.5))

  def test_limits_cost_a_tenth_of_the_push_outwards(self):
    # At the +x face, pushing out by 0.5; at the floor, pushing down by 1.
    at_edge = state(tcp=(0.148, 0.5, 0.147), action=(0.5, 0.0, -1.0, 0.0))
    self.assertAlmostEqual(terms.limits(at_edge), -0.15)
    inwards = dataclasses.replace(at_edge, action=(-1.0, 0.0, 1.0, 0.0))
    self.assertEqual(terms.limits(inwards), 0.0)

  @parameterized.product(axis=(0, 1, 2), side=(-1, 1))
  def test_every_face_of_the_box_limits(self, axis, side):
    face = (ws.SET_POINT_LOW if side < 0 else ws.SET_POINT_HIGH)[axis]
    for inside, expected in ((0.004, -0.1), (0.006, 0.0)):
      tcp, action = [0.0, 0.5, 0.2], [0.0] * 4
      tcp[axis], action[axis] = face - side * inside, side
      at_face = state(tcp=tuple(tcp), action=tuple(action))
      self.assertAlmostEqual(terms.limits(at_face), expected)

  def test_open_is_1_less_half_the_movement_near_a_block(self):
    opens = {"action": (0.3, 0.4, 0.0, -1.0)}
    self.check("open_gripper", 0.75, **opens)
    self.check("open_gripper", 0.0, tcp=(0.0, 0.6, 0.28), **opens)

  def test_close_with_the_wrong_sign_pays_for_the_movement_alone(self):
    self.check("close_gripper", -0.3, action=(0.0, 0.6, 0.0, -1.0))

  @parameterized.parameters(
    (0.185, 0.5, 0.9),  # gripped 4 cm up: 0.04 / 0.08 + 0.1 + 0.3
    (0.185, 1.0, 0.1),  # open fingers: neither height nor grasp
    (0.235, 0.5, 1.9),  # 9 cm up: 1.5 + 0.1 + 0.3
  )
  def test_lift_pays_height_near_and_grasp(self, z, opening, expected):
    at = {"blue": (0.0, 0.5, z), "tcp": (0.0, 0.5, z)}
    self.check("lift", expected, fingers=(opening, opening), **at)

  @parameterized.parameters((0.11, 0.4), (0.09, 0.1))
  def test_lift_pays_a_grasp_on_the_floor_once_it_moves_up(self, up, expected):
    held = {"tcp": _REST.blue, "fingers": (0.5, 0.5)}
    self.check("lift", expected, action=(0.0, 0.0, up, 1.0), **held)

  def test_move_object_pays_speed_and_carrying_less_jerk(self):
    # 5 x 0.1 + near 0.1 + carried 0.1 - 0.1 x min(3, 1.5).
    at = {"blue": (0.0, 0.5, 0.165), "tcp": (0.0, 0.5, 0.165)}
    speed = {"blue_speed": 0.1, "blue_acceleration": 3.0}
    self.check("move_object", 0.55, fingers=(0.5, 0.5), **at, **speed)
    # The same speed counts within 4 cm of the hand alone.
    for distance, expected in ((0.039, 0.6), (0.041, 0.1)):
      tcp = (0.0, 0.5, 0.145 + distance)
      self.check("move_object", expected, tcp=tcp, blue_speed=0.1)

  def test_bring_pays_closeness_then_letting_go(self):
    at = {"blue": (0.035, 0.53, 0.145), "tcp": (0, 0.5, 0.145)}
    self.check("bring", 1 - math.tanh(0.5), **at)  # 5 cm to go
    # At the goal, opening, 2 cm away: 1.5 + 0.3 x 0.5.
    above = {"tcp": (0.075, 0.5, 0.165), "action": (0, 0, 0, -1.0)}
    self.check("bring", 1.65, **_IN_ZONE, **above)
    self.check("bring", 1.5, **_IN_ZONE, tcp=above["tcp"])  # not opening

  def test_insert_wants_a_millimetre(self):
    almost = 1 - math.tanh(0.1)
    self.check("insert", almost, **_IN_ZONE, tcp=(0.075, 0.5, 0.145))

  def test_stack_pays_placing_retreat_lift_and_opening(self):
    # 41 mm above green, 2 cm from the hand, still, opening by 0.5: place 1.5,
    # retreat 0.5, lift 0.2, no grasp at 2 cm, open 1.5.
    at = {"blue": (-0.1, 0.5, 0.186), "tcp": (-0.1, 0.5, 0.206)}
    opens = {"fingers": (0.5, 0.5), "action": (0.0, 0.0, 0.0, -0.5)}
    self.check("stack", 3.7, **at, **opens)
    self.check("stack", 3.2, blue_speed=0.011, **at, **opens)  # no retreat
    # 6 mm too high: neither placed nor to be opened for.
    high = {"blue": (-0.1, 0.5, 0.192), "tcp": (-0.1, 0.5, 0.212)}
    self.check("stack", 0.7 + 1 - math.tanh(0.06), **high, **opens)
    self.check("stack", 0.0, tcp=(0.0, 0.5, 0.246))

  def test_stack_lift_term_rises_to_35_mm_and_not_to_7(self):
    held = {"fingers": (0.5, 0.5), "tcp": (0.0, 0.5, 0.165)}
    goal = GOALS["stack"]
    at_14 = goal.dense_terms(state(blue=(0.0, 0.5, 0.159), **held))["lift"]
    self.assertAlmostEqual(at_14, 0.2 * 0.014 / 0.035)

  def test_off_tray_penalty_is_for_a_green_block_1_mm_off(self):
    self.assertEqual(terms.off_tray_penalty(_REST), 0.0)
    raised = state(green=(-0.1, 0.5, ws.STACKED_Z))
    self.assertEqual(terms.off_tray_penalty(raised), -0.1)
