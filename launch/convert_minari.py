"""Converts demonstrations to Minari and back; needs the extra `minari`.

  python launch/convert_minari.py --dataset=data/stack_reset \
      --minari=lfgp_dmc/stack_reset
  python launch/convert_minari.py --minari=lfgp_dmc/stack_reset --back \
      --dataset=data/from_minari

A dataset folder becomes one Minari dataset a task, `ID/TASK-v0`. The way back
takes all local ones under `ID/`; of others' datasets --attributes says what our
files need: --attributes=task=stack,expert=human,...
"""

import dataclasses
import functools
import pathlib
import warnings

from absl import flags

from lfgp_dmc.data import demonstrations, files
from lfgp_dmc.launch import command
from lfgp_dmc.launch.command import UserError

_DATASET = flags.DEFINE_string("dataset", "", "Our dataset folder.")
_MINARI = flags.DEFINE_string("minari", "", "Minari's namespace for it.")
_BACK = flags.DEFINE_bool("back", False, "From Minari to a new folder.")
_ATTRIBUTES = flags.DEFINE_list(
  "attributes", [], "name=value pairs that go over those in Minari."
)

_NUMBERS = {"seed": int, "control_hz": float}


def main() -> None:
  """Converts every task, and prints the names."""
  if not _DATASET.value or not _MINARI.value:
    raise UserError("give --dataset=FOLDER and --minari=NAMESPACE")
  try:
    import minari

    from lfgp_dmc.data import minari_datasets
  except ImportError as error:
    raise UserError(f"{error}; pip install 'lfgp-dmc[minari]'") from None
  warnings.filterwarnings("ignore", category=UserWarning, module="minari")
  folder, prefix = pathlib.Path(_DATASET.value), f"{_MINARI.value.rstrip('/')}/"
  with command.checked_input():
    if not _BACK.value:
      paths = files.own(folder, demonstrations.SUFFIX)
      if not paths:
        raise UserError(f"no dataset in {folder}")
      ours = {f"{prefix}{p.stem}-v0": demonstrations.read(p) for p in paths}
      minari_datasets.to_minari(ours)
      print("\n".join(ours))
      return
    files.check_writable(folder / "a")
    names = [n for n in sorted(minari.list_local_datasets())
             if n.startswith(prefix)]  # fmt: skip
    if not names:
      raise UserError(f"no local Minari dataset starts with {prefix}")
    found: dict[str, demonstrations.Demonstrations] = {}
    for name in names:
      data = minari_datasets.from_minari(name, _attributes())
      stem = name.removeprefix(prefix).rpartition("-v")[0]
      task = str(data.attributes.get("task", stem))
      if task in found:
        raise UserError(f"{name} is a second dataset of {task}; keep one")
      attributes = {"task": task, **data.attributes}
      found[task] = dataclasses.replace(data, attributes=attributes)
    demonstrations.write_folder(folder, found)
    for task in found:
      print(folder / (task + demonstrations.SUFFIX))


def _attributes() -> dict[str, str | float]:
  values: dict[str, str | float] = {}
  for pair in _ATTRIBUTES.value:
    name, equals, value = pair.partition("=")
    if not equals:
      raise UserError(f"--attributes={pair}; valid: name=value,...")
    try:
      values[name] = _NUMBERS.get(name, str)(value)
    except ValueError as error:
      raise UserError(f"--attributes={pair}: {error}") from None
  return values


cli = functools.partial(command.run, main)

if __name__ == "__main__":
  cli()
