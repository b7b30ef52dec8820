"""The table that the demonstration ends in: policies on the same resets."""

import functools
import pathlib
import tempfile
from collections.abc import Callable, Mapping, Sequence

from lfgp_dmc.acting import evaluation
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from lfgp_dmc.launch import command, demo_video, policies
from lfgp_dmc.launch.configs import RunConfig
from lfgp_dmc.runs.run_folder import RunFolder

BC = "bc"  # the folder of cloning in the run's


def columns(
  config: RunConfig, path: pathlib.Path, stored: policies.PolicySpec | None
) -> dict[str, list[EvaluationRow]]:
  """The table's columns: every policy on the same resets.

  Args:
    config: of the run.
    path: its folder; of cloning, if there are demonstrations, the one in it.
    stored: another policy, if any.
  """
  from lfgp_dmc.launch import training

  tasks = policies.find(str(path)).tasks
  with tempfile.TemporaryDirectory() as folder:
    training.write_untrained_policy(config, pathlib.Path(folder))
    make = functools.partial(policies.stored_policy, folder)
    untrained = _evaluate(config, "the untrained agent", make, tasks)
  found = {"untrained": untrained}
  if config.demonstrations:
    found["BC"] = _trained(path / BC)
  found["trained"] = _trained(path)
  if stored is not None:
    able = [task for task in tasks if task in stored.tasks]
    at_its_rate = demo_video.at_rate_of(stored, config)
    name = str(stored.folder)
    found["stored"] = _evaluate(at_its_rate, name, stored.make, able)
  make = functools.partial(policies.scripted_expert, config.control_hz)
  found["expert"] = _evaluate(config, "the scripted expert", make, tasks)
  return found


def table(
  config: RunConfig, found: Mapping[str, Sequence[EvaluationRow]]
) -> str:
  """Success by task, the `found` columns side by side."""
  rates = {
    name: evaluation_csv.success_rates(list(rows))
    for name, rows in found.items()
  }
  lines = [
    f"success on the same {config.evaluation_episodes} resets of "
    f"{config.main_task}, after {config.env_steps} environment steps",
    f"{'task':<16}" + "".join(f"{name:>12}" for name in rates),
  ]
  for task in rates["trained"]:
    values = (column.get(task) for column in rates.values())
    cells = ("-" if value is None else f"{value:.0%}" for value in values)
    lines.append(f"{task:<16}" + "".join(f"{cell:>12}" for cell in cells))
  return "\n".join(lines)


def _trained(path: pathlib.Path) -> list[EvaluationRow]:
  """A run's last evaluation."""
  rows = evaluation_csv.read_csv(RunFolder(path).evaluation)
  return evaluation_csv.newest(rows)


def _evaluate(
  config: RunConfig, name: str, make_actor: Callable, tasks: Sequence[str]
) -> list[EvaluationRow]:
  print(f"evaluating {name} on the same resets", flush=True)
  return evaluation.evaluate(
    functools.partial(config.environment_spec.build, True),
    make_actor,
    tasks,
    config.evaluation_episodes,
    config.evaluation_seed,
    config.evaluation_workers or command.cores(),
  )
