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
import time

from absl import flags

from lfgp_dmc import graphics
from lfgp_dmc.launch import (
  command,
  config_flags,
  demo_table,
  demo_video,
  policies,
)
from lfgp_dmc.launch.configs import ALGORITHMS, RunConfig
from lfgp_dmc.runs import run_folder

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
      runs[path / demo_table.BC] = _cloning(config)
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
  columns = demo_table.columns(config, path, stored)
  clip = demo_video.render(
    config,
    path,
    columns["trained"],
    stored,
    columns.get("stored", ()),
    (_HEIGHT.value, _WIDTH.value),
  )
  shown = demo_table.table(config, columns)
  (path / "success.txt").write_text(shown + "\n")
  print(f"\n{shown}\n")
  print(f"run folder      {path}")
  print(f"demonstrations  {config.demonstrations}")
  print(f"success table   {path / 'success.txt'}")
  print(f"learning curve  {figures[0] or 'none'}")
  print(f"video           {clip or graphics.fault()}")
  print(f"total time      {(time.monotonic() - start) / 60:.1f} minutes")
  return 0


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


cli = functools.partial(
  command.run, main, render=True, define_flags=config_flags.define
)

if __name__ == "__main__":
  cli()
