"""Policies by the names that commands take: of a folder, or the expert.

Everything here can be pickled into worker processes, and imports the simulator
or torch only when it is called.
"""

import dataclasses
import functools
import pathlib
from collections.abc import Callable
from typing import Any

import lfgp_dmc
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.launch.environment_spec import EnvironmentSpec
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.types import Actor

SCRIPTED = "scripted"


@dataclasses.dataclass(frozen=True)
class PolicySpec:
  """How to make a policy, and its environment."""

  make: Callable[[], Actor]  # picklable
  name: str  # for tables and sidecars
  environment_spec: EnvironmentSpec
  tasks: tuple[str, ...]  # its intentions, the main task first
  folder: pathlib.Path | None = None  # of a run
  config: dict[str, Any] = dataclasses.field(default_factory=dict)
  env_step: int = 0  # how long it was trained

  @property
  def main_task(self) -> str:
    """The task of its environment."""
    return self.environment_spec.main_task


def scripted_expert(control_hz: int = 20) -> Actor:
  """Makes the scripted expert of all nine tasks."""
  from lfgp_dmc.tasks import experts

  return experts.ScriptedExpert(control_hz=control_hz)


def stored_policy(folder: str) -> Actor:
  """Reads the policy of a run or policy folder."""
  from lfgp_dmc.agents.policy import Policy

  return Policy.load(folder)


def checkpointed_policy(folder: str, checkpoint: str) -> Actor:
  """Reads the policy that a run had at one of its checkpoints."""
  from lfgp_dmc.agents.policy import Policy

  options = run_folder.read_config(folder)[run_folder.POLICY_FIELD]
  return Policy.from_state(checkpoints.load(checkpoint)["agent"], options)


def find(
  run: str, expert: str | None = None, task: str = "", control_hz: int = 20
) -> PolicySpec:
  """The policy that `--run` or `--expert` names.

  Args:
    run: a run or policy folder, or "".
    expert: "scripted", or a run folder.
    task: whose environment the scripted expert gets.
    control_hz: of the scripted expert.

  Raises:
    UserError: none or both are given, or the folder holds no policy.
  """
  if bool(run) == bool(expert):
    raise UserError("give one of --run=FOLDER and --expert=scripted")
  if expert == SCRIPTED:
    task = task or lfgp_dmc.MAIN_TASKS[0]
    tasks = (task, *(t for t in lfgp_dmc.ALL_TASKS if t != task))
    make = functools.partial(scripted_expert, control_hz)
    return PolicySpec(
      make, "scripted expert", EnvironmentSpec(task, "", control_hz), tasks
    )
  path = pathlib.Path(run or str(expert))
  try:
    config = run_folder.read_config(path)
    policy: Any = stored_policy(str(path))
    main_task = config.get("main_task", policy.tasks[0])
    spec = EnvironmentSpec(
      main_task,
      config.get("environment", ""),
      config.get("control_hz", 20),
      config.get("camera_size", 0),
    )
    spec.check()
    if main_task not in policy.tasks:
      raise ValueError(
        f"config.main_task is {main_task!r}; the policy in {path} has: "
        f"{', '.join(policy.tasks)}"
      )
  except (ValueError, OSError) as error:
    raise UserError(str(error)) from None
  return PolicySpec(
    functools.partial(stored_policy, str(path)),
    path.name,
    spec,
    (main_task, *(t for t in policy.tasks if t != main_task)),
    path,
    config,
    int(config.get(run_folder.POLICY_FIELD, {}).get("env_step", 0)),
  )


def at_checkpoints(spec: PolicySpec, count: int) -> list[PolicySpec]:
  """A run's policies at its last `count` checkpoints, oldest first.

  Raises:
    UserError: there are fewer, or one of them is damaged.
  """
  found = []
  if spec.folder is not None:
    found = checkpoints.every(RunFolder(spec.folder).checkpoints)
  if len(found) < count:
    raise UserError(
      f"--checkpoints={count}: {spec.folder or 'the scripted expert'} has "
      f"{len(found)} checkpoints"
    )
  specs = []
  for path in found[-count:]:
    make = functools.partial(checkpointed_policy, str(spec.folder), str(path))
    try:
      make()
    except (ValueError, KeyError, OSError) as error:
      raise UserError(f"{path}: {error}") from None
    specs.append(dataclasses.replace(spec, make=make, env_step=int(path.name)))
  return specs
