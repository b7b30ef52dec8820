"""Measures this machine; prints name=value lines.

python launch/benchmark.py --what=bars --output=bars.csv
python launch/benchmark.py --what=presets --seconds=2 --output=presets.csv
python launch/benchmark.py --what=environment
python launch/benchmark.py --what=learner --preset=fast
python launch/benchmark.py --what=training --preset=fast
python launch/benchmark.py --what=acting --config.main_task=insert
python launch/benchmark.py --what=memory --steps=20000
python launch/benchmark.py --what=stability --steps=200000 --tasks=stack,reach
"""

import contextlib
import functools
import importlib
import itertools
import pathlib
import platform
from collections.abc import Iterator

from absl import flags

import lfgp_dmc
from lfgp_dmc.data import csv_files, files
from lfgp_dmc.launch import command, config_flags, configs
from lfgp_dmc.launch.command import UserError

_COLUMNS = ("name", "value", "bar")  # the last of bars alone
_DEFAULT_STEPS = {
  "bars": 900,
  "presets": 0,  # they are timed instead, as is a learner
  "environment": 7_200,
  "learner": 0,
  "training": 900,
  "acting": 50,
  "memory": 20_000,
  "stability": 200_000,
}

_WHAT = flags.DEFINE_enum(
  "what",
  "environment",
  list(_DEFAULT_STEPS),
  "bars: what the presets' users wait for, beside what it should be, in five "
  "minutes of an idle machine. presets: the learner of each. "
  "environment: control steps a second through dm_env, the physics' alone, a "
  "reset's time. learner: updates a second, against "
  "matrix products. training: the whole loop, against the learner alone, and "
  "beside a busy process. acting: evaluation and collection. "
  "memory: with a full replay on disk. stability: random steps that count NaN, "
  "MuJoCo's warnings and lost blocks.",
)
_STEPS = flags.DEFINE_integer(
  "steps",
  0,
  "Control steps; default: 7200 (environment), 900 (bars, training), 200000 a "
  "task (stability); of memory: updates, default 20000; of acting: episodes an "
  "intention, default 50.",
  lower_bound=0,
)
_TASKS = flags.DEFINE_list(
  "tasks", list(lfgp_dmc.ALL_TASKS), "Of stability: comma-separated."
)
_SEED = flags.DEFINE_integer("seed", 0, "Of resets and actions.", lower_bound=0)
_SECONDS = flags.DEFINE_float(
  "seconds", 8.0, "Of each measurement of updates.", lower_bound=0.0
)
_OUTPUT = flags.DEFINE_string("output", "", "Also a CSV file.")


_USED = {  # of these flags, and whether the config is
  "bars": ((_STEPS, _SECONDS), False),
  "presets": ((_SECONDS,), False),
  "environment": ((_STEPS, _SEED), True),
  "learner": ((_SECONDS,), True),
  "training": ((_STEPS, _SECONDS), True),
  "acting": ((_STEPS,), True),
  "memory": ((_STEPS,), True),
  "stability": ((_TASKS, _STEPS, _SEED), False),
}


def main() -> None:
  """Measures, prints, and writes the CSV file of `--output`."""
  for task in _TASKS.value:
    command.check_choice("tasks", task, lfgp_dmc.ALL_TASKS)
  output = pathlib.Path(_OUTPUT.value) if _OUTPUT.value else None
  if output:
    if output.exists():
      raise UserError(f"{output} exists; choose another --output")
    files.check_writable(output)
  with command.checked_input():
    config = config_flags.resolved()
  _check_flags(config)
  rows = []
  machine = ("machine", f"{_processor()}; {command.cores()} cores")
  for row in itertools.chain([machine], _measurements(config)):
    texts = [value if isinstance(value, str) else _text(value) for value in row]
    print("=".join(texts[:2]), *texts[2:], flush=True)
    rows.append(dict(zip(_COLUMNS, texts, strict=False)))
  if output:
    output.parent.mkdir(parents=True, exist_ok=True)
    csv_files.write(output, list(rows[-1]), rows)


def _check_flags(config: configs.RunConfig) -> None:
  """Raises UserError for what would be ignored or cannot be measured."""
  what = _WHAT.value
  used, is_of_config = _USED[what]
  known = {flag.name for flag in used}  # flags themselves have no ==
  given = (_STEPS, _TASKS, _SEED, _SECONDS)
  useless = [f.name for f in given if f.present and f.name not in known]
  if not is_of_config:
    useless += config_flags.given()
  if useless:
    raise UserError(f"--{useless[0]} does nothing with --what={what}")
  needs_floats = what in ("training", "acting", "memory")
  if config.environment or (needs_floats and config.camera_size):
    raise UserError("benchmarks are of the block tasks and their 59 floats")
  is_cloning = configs.ALGORITHMS[config.algorithm].is_supervised
  if is_cloning and what != "environment":
    raise UserError(
      f"--config.algorithm={config.algorithm} does not act; valid: what does"
    )


def _text(value: float) -> str:
  return f"{value:.0f}" if value == round(value) else f"{value:.4g}"


def _processor() -> str:
  """The processor's name, as far as the system tells."""
  with contextlib.suppress(OSError):
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
      if line.startswith("model name"):
        return line.partition(":")[2].strip()
  return platform.processor() or platform.machine()


def _measurements(config: configs.RunConfig) -> Iterator[tuple]:
  what, seed, seconds = _WHAT.value, _SEED.value, _SECONDS.value
  steps = _STEPS.value or _DEFAULT_STEPS[what]
  arguments: dict[str, tuple] = {
    "bars": (steps, seconds),
    "presets": (seconds,),
    "environment": (config, steps, seed),
    "learner": (config, seconds),
    "training": (config, steps, seconds),
    "acting": (config, steps),
    "memory": (config, steps),
    "stability": (_TASKS.value, steps, seed),
  }
  # Imported when needed: each needs only the simulator or only torch.
  module = importlib.import_module(f"lfgp_dmc.launch.benchmarks.{what}")
  return module.measure(*arguments[what])


cli = functools.partial(command.run, main, define_flags=config_flags.define)

if __name__ == "__main__":
  cli()
