"""The demonstration of the whole way, with whatever algorithm."""

from unittest import mock

from absl.testing import parameterized

from lfgp_dmc.launch import demo_table
from tests.launch import fixtures


class DemoTest(fixtures.RunTest):
  @parameterized.parameters(("lfgp", ["right", "left"]), ("dac", ["right"]))
  def test_compares_in_the_tasks_that_were_learned(self, algorithm, tasks):
    config = self.config(algorithm=algorithm, env_steps=40, evaluate_every=40)
    path, _ = self.train(config, "a")
    self.train(config, "a/bc")
    with mock.patch.object(
      demo_table, "_evaluate", return_value=[]
    ) as evaluate:
      columns = demo_table.columns(config, path, None)
    self.assertEqual([*columns], ["untrained", "BC", "trained", "expert"])
    for call in evaluate.call_args_list:
      self.assertCountEqual(call.args[-1], tasks)
    table = demo_table.table(config, columns).splitlines()
    self.assertEqual([line.split()[0] for line in table[2:]], tasks)
