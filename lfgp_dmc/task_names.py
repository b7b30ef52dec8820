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
  """T_all of any of the nine tasks, in the order of every K axis.

  The task itself comes first. `move_object` (the pre-training task of the
  paper's transfers) is learned with open, close, reach and lift; every other
  auxiliary task stands alone.
  """
  check_task(main_task)
  gripper, rest = AUXILIARY_TASKS[:2], AUXILIARY_TASKS[2:]
  if main_task == "insert":
    return (main_task, *gripper, "bring", *rest)
  if main_task in MAIN_TASKS:
    return (main_task, *AUXILIARY_TASKS)
  if main_task == "move_object":
    return (main_task, *AUXILIARY_TASKS[:-1])
  return (main_task,)
