"""Collects demonstrations: `<output>/<task>.hdf5` for each task of T_all.

`python launch/collect_demonstrations.py --task=stack --output=data/stack`
"""

import contextlib
import dataclasses
import functools
import pathlib
from typing import Any

from absl import flags

import lfgp_dmc
from lfgp_dmc.acting import collection, environments
from lfgp_dmc.acting.attempts import CollectionPlan
from lfgp_dmc.data import demonstration_summary, demonstrations, files
from lfgp_dmc.launch import command, policies
from lfgp_dmc.task_names import CONTROL_RATES
from lfgp_dmc.types import Actor

_TASK = flags.DEFINE_enum(
  "task", "stack", lfgp_dmc.ALL_TASKS, "The task whose T_all is collected."
)
_TASKS = flags.DEFINE_list("tasks", None, "Only these of T_all, a,b,...")
_COLLECTION = flags.DEFINE_enum(
  "collection", "reset", collection.COLLECTIONS, "play: no resets in between."
)
_PAIRS = flags.DEFINE_integer("pairs_per_task", 9000, "Pairs, exactly.", 1)
_ATTEMPTS = flags.DEFINE_integer(
  "attempts_per_task",
  0,
  "Whole successful attempts a task, instead of --pairs_per_task.",
  lower_bound=0,
)
_FINALS = flags.DEFINE_integer(
  "final_pairs",
  0,
  "Extra pairs a task: the row of success of so many further attempts. The "
  "journal version's 1000 pairs: --pairs_per_task=800 --final_pairs=200.",
  lower_bound=0,
)
_LONGEST = flags.DEFINE_integer(
  "keep_longest_of",
  1,
  "Keep the longest of so many attempts: hard starts are over-sampled. With "
  "--collection=reset.",
  lower_bound=1,
)
_SEED = flags.DEFINE_integer(
  "seed", 0, "Everything random follows from it.", 0, 2**63 - 1
)
_OUTPUT = flags.DEFINE_string("output", None, "New folder for the dataset.")
_EXPERT = flags.DEFINE_string(
  "expert", "scripted", "scripted, or the folder of a run or policy."
)
_WORKERS = flags.DEFINE_integer(
  "workers", 0, "Processes; 0: one a core. The data are the same.", 0, 4096
)

_HERTZ = flags.DEFINE_integer(
  "control_hz", 20, "Control steps a second: 20, 10 or 5."
)

_CAMERA = flags.DEFINE_integer(
  "camera_size",
  0,
  "Pairs from pixels: the side of the cameras' frames; 0: the 59 floats.",
  lower_bound=0,
)


def sampling_actor(make_policy) -> Actor:
  """A stored policy that samples its actions, as the paper's experts do."""
  policy = make_policy()
  policy.deterministic = False
  return policy


def main() -> int:
  """Collects, writes, and prints a summary."""
  output, tasks = _check_flags()
  try:
    found = collection.collect(
      _plan(),
      _COLLECTION.value,
      tasks,
      _PAIRS.value,
      workers=_WORKERS.value or command.cores(),
      finals=_FINALS.value,
      attempts=_ATTEMPTS.value,
    )
  except collection.NoSuccessError as error:
    raise command.UserError(f"--expert={_EXPERT.value}: {error}") from None
  attributes = {
    "main_task": _TASK.value,
    "collection": _COLLECTION.value,
    "expert": _EXPERT.value,
    "seed": _SEED.value,
    "control_hz": _HERTZ.value,
  }
  data = {
    task: dataclasses.replace(
      part.demonstrations, attributes={"task": task, **attributes}
    )
    for task, part in found.items()
  }
  with command.checked_input():
    demonstrations.write_folder(output, data)
  print(f"{demonstration_summary.table(data)}\n")
  what = "attempts"
  if _LONGEST.value > 1:
    what = f"choices of {_LONGEST.value} attempts"
  for task, (_, attempts, successes) in found.items():
    print(
      f"{task:<16}{successes} of {attempts} {what} succeeded "
      f"({successes / attempts:.1%})"
    )
  print(f"wrote {output}")
  return 0


def _plan() -> CollectionPlan:
  """Who plays what, where; the expert must know all tasks, at this rate."""
  spec = policies.find("", _EXPERT.value, _TASK.value, _HERTZ.value)
  make_actor = spec.make
  if _EXPERT.value != policies.SCRIPTED:
    make_actor = functools.partial(sampling_actor, spec.make)
  tasks = lfgp_dmc.task_set(_TASK.value)
  if spec.environment_spec.control_hz != _HERTZ.value:
    raise command.UserError(
      f"--control_hz={_HERTZ.value}: --expert={_EXPERT.value} acts at "
      f"{spec.environment_spec.control_hz} Hz"
    )
  seen = spec.environment_spec.camera_size
  if seen not in (0, _CAMERA.value):
    raise command.UserError(
      f"--camera_size={_CAMERA.value}: --expert={_EXPERT.value} sees frames of "
      f"{seen}"
    )
  lacking = [task for task in tasks if task not in spec.tasks]
  if lacking:
    raise command.UserError(
      f"--expert={_EXPERT.value} cannot do {', '.join(lacking)} of "
      f"--task={_TASK.value}; it can do: {', '.join(spec.tasks)}"
    )
  options: dict[str, Any] = {"control_hz": _HERTZ.value}
  shape: tuple[int, ...] = ()
  if _CAMERA.value:
    options |= {"observations": "vision", "camera_size": _CAMERA.value}
    with (
      command.checked_input(),
      contextlib.closing(lfgp_dmc.load(_TASK.value, **options)) as environment,
    ):
      shape = environments.frame_shape(environment)
    if not seen:  # other experts than policies from pixels need the state
      options["observations"] = "all"
  return CollectionPlan(
    functools.partial(lfgp_dmc.load, **options),
    make_actor,
    _TASK.value,
    tasks,
    _SEED.value,
    _HERTZ.value,
    keep_longest_of=_LONGEST.value,
    frame_shape=shape,
  )


def _check_flags() -> tuple[pathlib.Path, list[str]]:
  """The output folder and the tasks to collect."""
  command.check_choice("control_hz", _HERTZ.value, CONTROL_RATES)
  if _LONGEST.value > 1 and _COLLECTION.value != "reset":
    raise command.UserError(
      f"--keep_longest_of={_LONGEST.value}; valid: 1 with --collection=play "
      "(its attempts follow from one another)"
    )
  if _ATTEMPTS.value and (_PAIRS.present or _FINALS.value):
    raise command.UserError(
      f"--attempts_per_task={_ATTEMPTS.value}; valid: 0 with --pairs_per_task "
      "or --final_pairs"
    )
  valid = lfgp_dmc.task_set(_TASK.value)
  tasks = list(dict.fromkeys(_TASKS.value or valid))
  for task in tasks:
    command.check_choice("tasks", task, valid)
  if not _OUTPUT.value:
    raise command.UserError("--output is not set: give a new folder's name")
  output = pathlib.Path(_OUTPUT.value)
  if output.exists():
    raise command.UserError(
      f"--output={output} exists; valid: a new folder (datasets are never "
      "written into)"
    )
  files.check_writable(output)  # better now than after minutes of collecting
  return output, tasks


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
