"""Every algorithm's agent keeps the contract of `lfgp_dmc/types.py`."""

import inspect

from absl.testing import parameterized

from lfgp_dmc import task_names, types
from lfgp_dmc.agents import synthetic
from lfgp_dmc.agents.parts import AgentParts
from lfgp_dmc.data.replay import Replay
from lfgp_dmc.launch import configs


class AgentContractTest(parameterized.TestCase):
  @parameterized.parameters(*configs.ALGORITHMS)
  def test_has_every_member_with_its_signature(self, name):
    algorithm, tasks = configs.ALGORITHMS[name], task_names.task_set("stack")
    agent = algorithm.build(
      configs.from_dict(configs.make_config(name).to_dict()).agent,
      AgentParts(
        tasks=tasks,
        demonstrations=synthetic.demonstrations(tasks, 60, 3, 2),
        replay=Replay(4, 3, 2, reward_tasks=tasks),
        seed=0,
        device="cpu",
        observation_size=3,
        action_size=2,
      ),
    )
    is_supervised = algorithm.is_supervised
    kind = types.SupervisedAgent if is_supervised else types.ActingAgent
    other = types.ActingAgent if is_supervised else types.SupervisedAgent
    self.assertIsInstance(agent, types.Agent)
    self.assertIsInstance(agent, kind)
    self.assertNotIsInstance(agent, other)
    for member, wanted in inspect.getmembers(kind, inspect.isfunction):
      if member.startswith("_"):
        continue
      found = inspect.signature(getattr(type(agent), member)).parameters
      expected = inspect.signature(wanted).parameters
      self.assertEqual([*found], [*expected], member)
