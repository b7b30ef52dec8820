"""Opens dm_control's viewer on a task, with or without a policy.

  python launch/view.py --task=stack
  python launch/view.py --task=insert --expert=scripted
  python launch/view.py --run=runs/stack_1 --task=reach

Without --run or --expert the arm holds still, to be looked at and pushed.
"""

import functools

import numpy as np
from absl import flags

import lfgp_dmc
from lfgp_dmc import graphics
from lfgp_dmc.acting import environments
from lfgp_dmc.launch import command, policies
from lfgp_dmc.launch.environment_spec import EnvironmentSpec

_TASK = flags.DEFINE_string(
  "task", "", "The task to look at; with --run, the intention that acts."
)
_RUN = flags.DEFINE_string("run", "", "A run's folder, or a policy folder.")
_EXPERT = flags.DEFINE_enum(
  "expert", None, [policies.SCRIPTED], "Instead of --run."
)
_SEED = flags.DEFINE_integer("seed", 0, "Of the resets and the actor.")


def main() -> None:
  """Opens the window."""
  task, spec = _TASK.value, None
  if task and not _RUN.value:
    command.check_choice("task", task, lfgp_dmc.ALL_TASKS)
  if _RUN.value or _EXPERT.value:
    spec = policies.find(_RUN.value, _EXPERT.value, task)
    task = command.check_choice("task", task or spec.main_task, spec.tasks)
  if not graphics.has_display():
    raise command.UserError(
      "the viewer needs a display, and DISPLAY names none that opens; "
      "without one, launch/render_policy.py makes videos"
    )
  _open(spec, task or lfgp_dmc.MAIN_TASKS[0])


def _open(spec: policies.PolicySpec | None, task: str) -> None:
  from dm_control import viewer

  where = spec.environment_spec if spec else EnvironmentSpec(task)
  environment = where.build(seed=_SEED.value)
  policy = None
  if spec:
    actor, flatten = spec.make(), environments.flattener(environment)

    def policy(timestep) -> np.ndarray:
      if timestep.first():
        actor.begin(task, _SEED.value)
      return actor.act(flatten(timestep.observation))

  print("space starts and pauses, backspace resets, [ and ] change the camera,")
  print("F1 shows all keys")
  viewer.launch(environment, policy, title=f"LfGP-DMC: {task}")


cli = functools.partial(command.run, main, window=True)

if __name__ == "__main__":
  cli()
