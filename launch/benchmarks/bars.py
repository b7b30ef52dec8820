"""The speeds that this project is held to, in one table."""

from collections.abc import Iterator

import lfgp_dmc
from lfgp_dmc.launch.benchmarks import acting, learner, training
from lfgp_dmc.launch.config_flags import config_of

_EPISODES = 50  # an intention, at 20 Hz


def measure(steps: int, seconds: float) -> Iterator[tuple[str, float, str]]:
  """Measures what each preset's runs wait for; see the other benchmarks.

  Yields:
    Names, values, and what the values should be; ratios are of one process.
  """
  for preset, least in (("fast", 65), ("few", 75)):
    config = config_of(f"--preset={preset}")
    found = dict(training.measure(config, steps, seconds))
    alone, whole = (
      found[f"{what}_updates_per_s_1thread"] for what in ("learner", "loop")
    )
    yield f"{preset}/learner_updates_per_s_1thread", alone, ">= 75"
    yield f"{preset}/run_updates_per_s_1thread", whole, f">= {least}"
    gain = found["second_thread_gain_beside_busy"]
    yield f"{preset}/run_2threads_to_1_beside_busy", gain, ">= 1"
  found = dict(learner.measure(config_of(), seconds, is_profiled=False))
  fraction = found["roofline_fraction_bf16_1thread"]
  yield "paper/bf16_1thread_of_matrix_rate", fraction, ">= 0.7"
  best = max(found[f"updates_per_s_{x}_2threads"] for x in ("fp32", "bf16"))
  gain = best / found["updates_per_s_fp32_1thread"]
  yield "paper/2threads_to_fp32_1thread", gain, ">= 3"
  dac = config_of("--config.algorithm=dac")
  found = dict(learner.measure(dac, seconds, is_profiled=False))
  rate = found["updates_per_s_fp32_1thread"]
  yield "dac/fp32_updates_per_s_1thread", rate, ">= 84"
  insert = config_of("--config.main_task=insert")
  found = dict(acting.measure(insert, _EPISODES))
  tasks = len(lfgp_dmc.task_set("insert"))
  episodes = found["evaluation_episodes"] / tasks
  yield f"evaluation_{tasks}x{episodes:.0f}_s", found["evaluation_s"], "<= 35"
  pairs = found["collection_pairs"] / tasks
  yield f"collection_{tasks}x{pairs:.0f}_s", found["collection_s"], "<= 45"
