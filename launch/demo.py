"""The whole way in minutes: collect, train, evaluate, draw, render.

  python launch/demo.py --flagfile=launch/flags/quickstart.flags

This is `make demo`. It ends, in a new folder under runs/, in a table of success
on the same resets (untrained agent, BC of the same demonstrations and tasks,
trained agent, a stored policy trained for longer, the expert), a learning
curve, and a video whose last clip is of the stored policy.
"""

import dataclasses
import functools
import pathlib
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence

from absl import flags

from lfgp_dmc import graphics
from lfgp_dmc.acting import evaluation
from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.data.evaluation_csv import EvaluationRow
from lfgp_dmc.launch import command, config_flags, demo_video, policies
from lfgp_dmc.launch.configs import ALGORITHMS, RunConfig
from lfgp_dmc.runs import run_folder
from lfgp_dmc.runs.run_folder import RunFolder

_RUN = flags.DEFINE_string(
  "run", "", "The run's folder; default: a new one under runs/."
)
_STORED = flags.DEFINE_string(
  "stored",
  "",
  "A policy folder to show beside it; default: results/policies/TASK, if it is "
  "there.",
)
_BC_UPDATES = flags.DEFINE_integer(
  "bc_updates", 3000, "Of BC, which is shown beside it.", 1
)
_HEIGHT = flags.DEFINE_integer("height", 480, "Of the video, pixels.", 32, 4320)
_WIDTH = flags.DEFINE_integer("width", 640, "Of the video, pixels.", 32, 7680)
_POLICIES = pathlib.Path("results/policies")
_BC_WIDTH = 256  # as in the README's table: better than narrower networks


def main() -> int:
  """Does everything, and says how long it took and where things are."""
  start = time.monotonic()
  with command.checked_input():
    config = config_flags.resolved()
    path = pathlib.Path(_RUN.value)
    if not _RUN.value:
      path = run_folder.default_path("quickstart", config.main_task)
    runs = {path: config}
    if config.demonstrations:
      runs[path / "bc"] = _cloning(config)
  stored = _stored_policy(config.main_task)
  from lfgp_dmc.launch import training  # loads torch: not for --help

  figures = []
  for folder, run in runs.items():
    print(f"training {run.algorithm} on {run.main_task} in {folder}")
    progress = training.train(run, folder)
    figures.append(training.draw(folder))
    if not progress.is_complete:
      print(f"stopped at step {progress.env_step} of {run.env_steps}")
      return command.INTERRUPTED
  columns = _columns(config, path, stored)
  clip = demo_video.render(
    config,
    path,
    columns["trained"],
    stored,
    columns.get("stored", ()),
    (_HEIGHT.value, _WIDTH.value),
  )
  shown = table(config, columns)
  (path / "success.txt").write_text(shown + "\n")
  print(f"\n{shown}\n")
  print(f"run folder      {path}")
  print(f"demonstrations  {config.demonstrations}")
  print(f"success table   {path / 'success.txt'}")
  print(f"learning curve  {figures[0] or 'none'}")
  print(f"video           {clip or graphics.fault()}")
  print(f"total time      {(time.monotonic() - start) / 60:.1f} minutes")
  return 0


def table(
  config: RunConfig, columns: Mapping[str, Sequence[EvaluationRow]]
) -> str:
  """Success by task, the columns side by side."""
  rates = {
    name: evaluation_csv.success_rates(list(rows))
    for name, rows in columns.items()
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


def _cloning(config: RunConfig) -> RunConfig:
  """BC of the same demonstrations and tasks, by the same preset."""
  is_multitask = ALGORITHMS[config.algorithm].is_multitask
  algorithm = "multitask_bc" if is_multitask else "bc"
  agent = config_flags.config_of(
    f"--preset={flags.FLAGS.preset}",
    f"--config.algorithm={algorithm}",
    f"--config.main_task={config.main_task}",
    f"--config.agent.networks.hidden_size={_BC_WIDTH}",
  ).agent
  return dataclasses.replace(
    config,
    algorithm=algorithm,
    agent=agent,
    init_from="",
    transfer_from="",
    env_steps=_BC_UPDATES.value,
    evaluate_every=_BC_UPDATES.value,
  )


def _trained(path: pathlib.Path) -> list[EvaluationRow]:
  """A run's last evaluation."""
  rows = evaluation_csv.read_csv(RunFolder(path).evaluation)
  return evaluation_csv.newest(rows)


def _columns(
  config: RunConfig, path: pathlib.Path, stored: policies.PolicySpec | None
) -> dict[str, list[EvaluationRow]]:
  """The table's columns: every policy on the same resets."""
  from lfgp_dmc.launch import training

  tasks = policies.find(str(path)).tasks
  with tempfile.TemporaryDirectory() as folder:
    training.write_untrained_policy(config, pathlib.Path(folder))
    make = functools.partial(policies.stored_policy, folder)
    untrained = _evaluate(config, "the untrained agent", make, tasks)
  columns = {"untrained": untrained}
  if config.demonstrations:
    columns["BC"] = _trained(path / "bc")
  columns["trained"] = _trained(path)
  if stored is not None:
    able = [task for task in tasks if task in stored.tasks]
    at_its_rate = demo_video.at_rate_of(stored, config)
    name = str(stored.folder)
    columns["stored"] = _evaluate(at_its_rate, name, stored.make, able)
  make = functools.partial(policies.scripted_expert, config.control_hz)
  columns["expert"] = _evaluate(config, "the scripted expert", make, tasks)
  return columns


def _stored_policy(main_task: str) -> policies.PolicySpec | None:
  """The policy to show beside the fresh one, if there is any."""
  folder = _STORED.value or str(_POLICIES / main_task)
  if not _STORED.value and not pathlib.Path(folder).is_dir():
    return None
  spec = policies.find(folder)
  if main_task not in spec.tasks:
    raise command.UserError(
      f"--stored={folder} cannot do {main_task}; it can do: "
      f"{', '.join(spec.tasks)}"
    )
  if spec.environment_spec.may_draw:
    raise command.UserError(
      f"--stored={folder} sees pixels or acts elsewhere; valid: a policy of "
      "the block tasks' 59 floats"
    )
  return spec


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


cli = functools.partial(
  command.run, main, render=True, define_flags=config_flags.define
)

if __name__ == "__main__":
  cli()
