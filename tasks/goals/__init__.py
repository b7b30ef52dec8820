"""The nine tasks' goals, by name."""

from lfgp_dmc.task_names import ALL_TASKS
from lfgp_dmc.tasks.goals.bring import BRING, INSERT
from lfgp_dmc.tasks.goals.goal import Goal
from lfgp_dmc.tasks.goals.gripper import CLOSE_GRIPPER, OPEN_GRIPPER
from lfgp_dmc.tasks.goals.lift import LIFT
from lfgp_dmc.tasks.goals.move_object import MOVE_OBJECT
from lfgp_dmc.tasks.goals.reach import REACH
from lfgp_dmc.tasks.goals.stack import STACK, UNSTACK_STACK

_MAIN = (STACK, UNSTACK_STACK, BRING, INSERT)
_AUXILIARY = (OPEN_GRIPPER, CLOSE_GRIPPER, REACH, LIFT, MOVE_OBJECT)
GOALS: dict[str, Goal] = {goal.name: goal for goal in _MAIN + _AUXILIARY}
if tuple(GOALS) != ALL_TASKS:
  raise AssertionError(f"goals {tuple(GOALS)} are not the tasks {ALL_TASKS}")

__all__ = ["GOALS", "Goal"]
