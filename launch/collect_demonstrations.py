"""Collects demonstrations: `<output>/<task>.hdf5` for each task of T_all.

`python launch/collect_demonstrations.py --task=stack --output=data/stack`
"""

import functools
import os
import pathlib
import tempfile

from absl import flags

import lfgp_dmc
from launch import actors, command
from lfgp_dmc import collection, demonstrations
from lfgp_dmc.collection_attempts import Plan
from lfgp_dmc.task_names import CONTROL_RATES
from lfgp_dmc.types import Actor

_TASK = flags.DEFINE_string(
  "task", "stack", "Main task (or any of the nine): its T_all is collected."
)
_TASKS = flags.DEFINE_list("tasks", None, "Only these of T_all, a,b,...")
_COLLECTION = flags.DEFINE_string(
  "collection", "reset", "reset (before each attempt) or play (none between)."
)
_PAIRS = flags.DEFINE_integer("pairs_per_task", 9000, "Pairs, exactly.")
_ATTEMPTS = flags.DEFINE_integer(
  "attempts_per_task",
  0,
  "Whole successful attempts a task, instead of --pairs_per_task.",
)
_FINALS = flags.DEFINE_integer(
  "final_pairs",
  0,
  "Extra pairs a task: the row of success of so many further attempts. The "
  "journal version's 1000 pairs: --pairs_per_task=800 --final_pairs=200.",
)
_LONGEST = flags.DEFINE_integer(
  "longest_of",
  1,
  "Of so many attempts keep the longest: starts that take more doing are shown "
  "more often. With --collection=reset.",
)
_SEED = flags.DEFINE_integer("seed", 0, "Everything random follows from it.")
_OUTPUT = flags.DEFINE_string("output", None, "New folder for the dataset.")
_EXPERT = flags.DEFINE_string(
  "expert", "scripted", "scripted, or the folder of a run or policy."
)
_WORKERS = flags.DEFINE_integer(
  "workers", 0, "Processes; 0: one a core. The data are the same."
)

_HERTZ = flags.DEFINE_integer(
  "control_hz", 20, "Control steps a second: 20, 10 or 5."
)


def sampling_actor(make_policy) -> Actor:
  """A stored policy that samples its actions, as the paper's experts do."""
  policy = make_policy()
  policy.deterministic = False
  return policy


def main() -> int:
  """Collects, writes and tells what it wrote."""
  output, tasks = _check_flags()
  cast = actors.find("", _EXPERT.value, _TASK.value, _HERTZ.value)
  make_actor = cast.make
  if _EXPERT.value != actors.SCRIPTED:
    make_actor = functools.partial(sampling_actor, cast.make)
  all_tasks = lfgp_dmc.task_set(_TASK.value)
  if cast.world.control_hz != _HERTZ.value:
    raise command.UserError(
      f"--control_hz={_HERTZ.value}: --expert={_EXPERT.value} acts at "
      f"{cast.world.control_hz} Hz"
    )
  lacking = [task for task in all_tasks if task not in cast.tasks]
  if lacking:
    raise command.UserError(
      f"--expert={_EXPERT.value} cannot do {', '.join(lacking)} of "
      f"--task={_TASK.value}; it can do: {', '.join(cast.tasks)}"
    )
  plan = Plan(
    functools.partial(lfgp_dmc.load, control_hz=_HERTZ.value),
    make_actor,
    _TASK.value,
    all_tasks,
    _SEED.value,
    _HERTZ.value,
    longest_of=_LONGEST.value,
  )
  try:
    found = collection.collect(
      plan,
      _COLLECTION.value,
      tasks,
      _PAIRS.value,
      workers=_WORKERS.value or command.cores(),
      finals=_FINALS.value,
      attempts=_ATTEMPTS.value,
    )
  except collection.NoSuccessError as error:
    raise command.UserError(f"--expert={_EXPERT.value}: {error}") from None
  _write(output, found)
  print(f"{demonstrations.summary_table(_data(found))}\n")
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


def _check_flags() -> tuple[pathlib.Path, list[str]]:
  """The output folder and the tasks to collect."""
  command.check_choice("task", _TASK.value, lfgp_dmc.ALL_TASKS)
  command.check_choice("collection", _COLLECTION.value, collection.COLLECTIONS)
  command.check_choice("control_hz", _HERTZ.value, CONTROL_RATES)
  command.check_least("pairs_per_task", _PAIRS.value, 1)
  command.check_least("attempts_per_task", _ATTEMPTS.value, 0)
  command.check_least("final_pairs", _FINALS.value, 0)
  if _ATTEMPTS.value and _PAIRS.present:
    raise command.UserError(
      f"--attempts_per_task={_ATTEMPTS.value} and --pairs_per_task="
      f"{_PAIRS.value}; valid: one of the two"
    )
  if _ATTEMPTS.value and _FINALS.value:
    raise command.UserError(
      f"--final_pairs={_FINALS.value}; valid: 0 with --attempts_per_task "
      "(every attempt ends with its row of success)"
    )
  command.check_least("longest_of", _LONGEST.value, 1)
  if _LONGEST.value > 1 and _COLLECTION.value != "reset":
    raise command.UserError(
      f"--longest_of={_LONGEST.value}; valid: 1 with --collection=play (its "
      "attempts follow from one another)"
    )
  command.check_least("seed", _SEED.value, 0)
  command.check_least("workers", _WORKERS.value, 0)
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
  # Better now than after minutes of collecting.
  output.parent.mkdir(parents=True, exist_ok=True)
  if not os.access(output.parent, os.W_OK):
    raise command.UserError(f"--output={output}: cannot write there")
  return output, tasks


def _data(found: dict[str, collection.Collected]):
  return {task: part.demonstrations for task, part in found.items()}


def _write(
  output: pathlib.Path, found: dict[str, collection.Collected]
) -> None:
  """Writes the dataset aside, then gives it its name: whole or not at all."""
  prefix = f".{output.name}.partial."
  with tempfile.TemporaryDirectory(prefix=prefix, dir=output.parent) as aside:
    folder = demonstrations.create_folder(pathlib.Path(aside) / output.name)
    for task, data in _data(found).items():
      attributes = {
        "task": task,
        "main_task": _TASK.value,
        "collection": _COLLECTION.value,
        "expert": _EXPERT.value,
        "seed": _SEED.value,
        "control_hz": _HERTZ.value,
      }
      path = folder / (task + demonstrations.SUFFIX)
      demonstrations.write(path, data, attributes)
    if output.exists():
      raise command.UserError(f"--output={output} appeared meanwhile")
    os.rename(folder, output)


if __name__ == "__main__":
  command.run(main)
