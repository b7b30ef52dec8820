"""The nine tasks by name, and which tasks are learned together.

Table "env_details" of the paper: a main task is learned with its auxiliary
tasks, T_all = {T_main} + T_aux.
"""

MAIN_TASKS = ("stack", "unstack_stack", "bring", "insert")
AUXILIARY_TASKS = (
  "open_gripper",
  "close_gripper",
  "reach",
  "lift",
  "move_object",
)
ALL_TASKS = MAIN_TASKS + AUXILIARY_TASKS

CONTROL_RATES = (20, 10, 5)  # Hz: a success check falls every 50 ms


def check_task(task: str) -> str:
  """Returns `task` unchanged; raises ValueError if it is not a task."""
  if task not in ALL_TASKS:
    raise ValueError(
      f"unknown task {task!r}; valid tasks: {', '.join(ALL_TASKS)}"
    )
  return task


def task_set(main_task: str) -> tuple[str, ...]:
  """T_all of a main task, the main task first.

  Args:
    main_task: any of the nine tasks. `move_object` (the pre-training task of
      the paper's transfers) is learned with open, close, reach and lift; every
      other auxiliary task stands alone.

  Returns:
    The names of the tasks learned together, in the order of every K axis.
  """
  check_task(main_task)
  if main_task == "insert":
    auxiliary: tuple[str, ...] = (
      "open_gripper",
      "close_gripper",
      "bring",
      "reach",
      "lift",
      "move_object",
    )
  elif main_task in MAIN_TASKS:
    auxiliary = AUXILIARY_TASKS
  elif main_task == "move_object":
    auxiliary = ("open_gripper", "close_gripper", "reach", "lift")
  else:
    auxiliary = ()
  return (main_task, *auxiliary)
