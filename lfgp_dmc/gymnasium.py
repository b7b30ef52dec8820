"""Registers the nine tasks with Gymnasium; needs the extra `gymnasium`.

    import gymnasium
    import lfgp_dmc.gymnasium

    env = gymnasium.make("lfgp_dmc/UnstackStack-v0", reward="dense")
    observation, info = env.reset(seed=0)

`gymnasium.make("lfgp_dmc.gymnasium:lfgp_dmc/Stack-v0")` needs no second import.
Options are those of `lfgp_dmc.load`; observations and `info` are described in
`tasks/gymnasium_environment.py`, which is imported by the first environment.
"""

import gymnasium

from lfgp_dmc.task_names import ALL_TASKS

NAMESPACE = "lfgp_dmc"
_MAKE = "lfgp_dmc.tasks.gymnasium_environment:BlockEnvironment"


def environment_id(task: str) -> str:
  """Such as "lfgp_dmc/UnstackStack-v0" of "unstack_stack"."""
  name = "".join(word.capitalize() for word in task.split("_"))
  return f"{NAMESPACE}/{name}-v0"


for _task in ALL_TASKS:
  gymnasium.register(
    environment_id(_task), entry_point=_MAKE, kwargs={"task": _task}
  )
