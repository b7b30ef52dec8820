"""Each preset's updates, and where their time goes."""

import pathlib
from collections.abc import Iterator

from lfgp_dmc.launch import config_flags, configs
from lfgp_dmc.launch.benchmarks import learner

_FLAGS = pathlib.Path(learner.__file__).parents[1] / "flags"
_OTHERS = {
  "dac": ["--config.algorithm=dac"],
  "from_scratch": [f"--flagfile={_FLAGS / 'from_scratch.flags'}"],
}


def measure(seconds: float) -> Iterator[tuple[str, float]]:
  """Yields what `learner` yields for each preset, as `<preset>/<name>`.

  Of DAC with the paper's settings, and of imitation from scratch, too.
  """
  presets = {name: [f"--preset={name}"] for name in configs.PRESETS}
  for label, arguments in {**presets, **_OTHERS}.items():
    config = config_flags.config_of(*arguments)
    for name, value in learner.measure(config, seconds):
      yield f"{label}/{name}", value
