"""The speeds that this project is held to, in one table."""

from collections.abc import Iterator

import lfgp_dmc
from lfgp_dmc.launch import configs
from lfgp_dmc.launch.benchmarks import acting, learner, training

_EPISODES = 50  # an intention, at 20 Hz


def measure(steps: int, seconds: float) -> Iterator[tuple[str, float, str]]:
  """Measures what each preset's runs wait for; see the other benchmarks.

  Yields:
    Names, values, and what the values should be; ratios are of one process.
  """
  for preset, least in (("fast", 65), ("few", 75)):
    found = dict(training.measure(_config(preset), steps, seconds))
    alone, whole = (
      found[f"{what}_updates_per_s_1thread"] for what in ("learner", "loop")
    )
    yield f"{preset}/learner_updates_per_s_1thread", alone, ">= 75"
    yield f"{preset}/run_updates_per_s_1thread", whole, f">= {least}"
    gain = found["second_thread_gain_beside_busy"]
    yield f"{preset}/run_2threads_to_1_beside_busy", gain, ">= 1"
  found = dict(learner.measure(_config("paper"), seconds))
  fraction = found["roofline_fraction_bf16_1thread"]
  yield "paper/bf16_1thread_of_matrix_rate", fraction, ">= 0.7"
  best = max(found[f"updates_per_s_{x}_2threads"] for x in ("fp32", "bf16"))
  gain = best / found["updates_per_s_fp32_1thread"]
  yield "paper/2threads_to_fp32_1thread", gain, ">= 3"
  found = dict(learner.measure(_config("paper", "dac"), seconds))
  rate = found["updates_per_s_fp32_1thread"]
  yield "dac/fp32_updates_per_s_1thread", rate, ">= 84"
  found = dict(acting.measure(_config("paper", main_task="insert"), _EPISODES))
  tasks = len(lfgp_dmc.task_set("insert"))
  episodes = found["evaluation_episodes"] / tasks
  yield f"evaluation_{tasks}x{episodes:.0f}_s", found["evaluation_s"], "<= 35"
  pairs = found["collection_pairs"] / tasks
  yield f"collection_{tasks}x{pairs:.0f}_s", found["collection_s"], "<= 45"


def _config(
  preset: str, algorithm: str = "lfgp", main_task: str = "stack"
) -> configs.RunConfig:
  values = configs.make_config(algorithm, preset, main_task).to_dict()
  return configs.from_dict({**values, "main_task": main_task})
