"""Trains an agent by a flagfile, and continues a run that was stopped.

  python launch/train.py --flagfile=launch/flags/lfgp.flags \
      --config.seed=1 --run=runs/stack_1
  python launch/train.py --run=runs/stack_1 --resume

The run's folder gets config.json, metrics.csv, evaluation.csv, TensorBoard
events, checkpoints/, replay/ and policy.safetensors; in the end also
learning_curve.png, which launch/plot.py --run draws at any time.
"""

import functools
import pathlib
import shlex

from absl import flags

from lfgp_dmc.data import evaluation_csv
from lfgp_dmc.launch import command, config_flags, configs
from lfgp_dmc.launch.command import UserError
from lfgp_dmc.runs import checkpoints, run_folder
from lfgp_dmc.runs.run_folder import RunFolder
from lfgp_dmc.runs.schedule import Progress

_RUN = flags.DEFINE_string(
  "run", "", "The run's folder; default: a new one under runs/."
)
_RESUME = flags.DEFINE_bool(
  "resume",
  False,
  "Continue --run from its last good checkpoint, with its own config; flags "
  "may name more steps, or where its demonstrations are now.",
)


def main() -> int:
  """Resolves the config, trains, and says where everything is."""
  config = _config()
  path = pathlib.Path(configs.fill(_RUN.value, config.to_dict()))
  if not _RUN.value:
    path = run_folder.default_path(config.algorithm, config.main_task)
  print(f"{config.algorithm} on {config.main_task}, run folder {path}")
  from lfgp_dmc.launch import training  # loads torch: not for --help

  stored = checkpoints.every(RunFolder(path).checkpoints)
  progress = training.train(config, path, _RESUME.value)
  if progress.is_complete:  # whoever stops a run waits
    training.draw(path)
    if stored and int(stored[-1].name) == progress.env_step:
      print(f"the run was at its end already, at {progress.env_step}")
  return report(config, path, progress)


def report(
  config: configs.RunConfig, path: pathlib.Path, progress: Progress
) -> int:
  """Prints the last evaluation and the places; returns the exit status."""
  if not progress.is_complete:
    again = shlex.join(
      ["python", "launch/train.py", f"--run={path}", "--resume"]
    )
    print(
      f"stopped at {progress.env_step} of {config.env_steps}; continue: {again}"
    )
    return command.INTERRUPTED
  folder = RunFolder(path)
  rows = evaluation_csv.read_csv(folder.evaluation)
  is_supervised = configs.ALGORITHMS[config.algorithm].is_supervised
  unit = "updates" if is_supervised else "environment steps"
  print(f"\nsuccess after {progress.env_step} {unit}:")
  print(evaluation_csv.success_table(evaluation_csv.newest(rows)))
  if not progress.update:
    print(
      f"\nnothing was learned: config.warm_up={config.warm_up} left no step"
    )
  print(f"\nmetrics      {folder.metrics} (and TensorBoard beside it)")
  print(f"evaluation   {folder.evaluation}")
  print(f"policy       {path / run_folder.ARRAYS_NAME}")
  return 0


def _config() -> configs.RunConfig:
  """The config of the flags, which --resume lays over the run's own."""
  with command.checked_input():
    if not _RESUME.value:
      return config_flags.resolved()
    if not _RUN.value:
      raise UserError("--resume needs --run: the folder to continue")
    path = configs.fill(_RUN.value, flags.FLAGS.config.to_dict())
    stored = run_folder.settings(run_folder.read_config(path))
    try:
      return config_flags.resumed(stored)
    except ValueError as error:
      raise UserError(f"{path}/{run_folder.CONFIG_NAME}: {error}") from None


cli = functools.partial(command.run, main, define_flags=config_flags.define)

if __name__ == "__main__":
  cli()
