"""Which demonstrations several main tasks share, read from the files.

The paper's table of dataset sizes: multitask methods use one file a task of
T_all, single-task methods one large file of the main task alone.
"""

import pathlib
from collections.abc import Sequence
from typing import NamedTuple

from lfgp_dmc.data import demonstrations, files
from lfgp_dmc.task_names import MAIN_TASKS

COLUMNS = ("class", "main_task", "collection", "dataset", "tasks",
           "pairs_per_task", "reusable", "single", "total")  # fmt: skip


class Dataset(NamedTuple):
  """What a dataset folder holds."""

  path: pathlib.Path
  main_task: str
  collection: str
  pairs: dict[str, int]  # task -> pairs, the main task first


def read(folder: files.Path) -> Dataset:
  """Reads and checks every file of a folder.

  Raises:
    ValueError: it holds no demonstrations, damaged ones, or of several main
      tasks or collections.
  """
  folder = pathlib.Path(folder)
  tasks = sorted(p.stem for p in folder.glob(f"*{demonstrations.SUFFIX}"))
  if not tasks:
    raise ValueError(f"no dataset in {folder}: no {demonstrations.SUFFIX} file")
  found = demonstrations.read_folder(folder, tasks)
  kinds = {
    (str(data.attributes["main_task"]), str(data.attributes["collection"]))
    for data in found.values()
  }
  if len(kinds) > 1:
    raise ValueError(f"{folder} mixes main tasks or collections: {kinds}")
  ((main_task, collection),) = kinds
  order = sorted(found, key=lambda task: (task != main_task, task))
  pairs = {task: len(found[task]) for task in order}
  return Dataset(folder, main_task, collection, pairs)


def rows(datasets: Sequence[Dataset]) -> list[dict[str, object]]:
  """The table's rows, multitask first, in the order of the main tasks.

  Args:
    datasets: any number of a main task.

  Returns:
    By `COLUMNS`. `reusable` counts the pairs of tasks that more than one main
    task of the table learns with (their names are in capitals); only
    reset-based data are, since play-based data depend on the main task.
  """
  users: dict[str, set[str]] = {}
  for one in datasets:
    if _is_multitask(one) and one.collection == "reset":
      for task in one.pairs:
        users.setdefault(task, set()).add(one.main_task)
  table = []
  for one in sorted(datasets, key=_order):
    can_share = _is_multitask(one) and one.collection == "reset"
    shared = {task for task in one.pairs if can_share and len(users[task]) > 1}
    reusable = sum(one.pairs[task] for task in shared)
    total = sum(one.pairs.values())
    sizes = sorted(set(one.pairs.values()))
    values = (
      "multitask" if _is_multitask(one) else "single-task",
      one.main_task,
      one.collection,
      str(one.path),
      " ".join(t.upper() if t in shared else t for t in one.pairs),
      " to ".join(str(size) for size in dict.fromkeys((sizes[0], sizes[-1]))),
      reusable,
      total - reusable,
      total,
    )
    table.append(dict(zip(COLUMNS, values, strict=True)))
  return table


def markdown(table: Sequence[dict[str, object]]) -> str:
  """The rows as a Markdown table."""
  lines = [COLUMNS, ["---"] * len(COLUMNS), *(row.values() for row in table)]
  return "".join(
    f"| {' | '.join(str(value) for value in line)} |\n" for line in lines
  )


def _is_multitask(dataset: Dataset) -> bool:
  return len(dataset.pairs) > 1


def _order(dataset: Dataset):
  known = {task: i for i, task in enumerate(MAIN_TASKS)}
  place = known.get(dataset.main_task, len(known))
  return (not _is_multitask(dataset), dataset.collection != "reset", place)
