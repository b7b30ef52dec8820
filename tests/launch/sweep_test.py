"""Sweeps: which runs there are, and how they come to their end."""

import json
import time
from unittest import mock

from lfgp_dmc.data import csv_files
from lfgp_dmc.launch.sweeps import jobs as jobs_lib
from lfgp_dmc.launch.sweeps import loop
from lfgp_dmc.launch.sweeps import starts as starts_lib
from lfgp_dmc.launch.sweeps.index import Index
from tests.fixtures import FolderTest


class FakeEngine:
  """Ends every run at once, by the exit statuses that it was given."""

  slots = 2

  def __init__(self, statuses):
    self.statuses = {name: list(ends) for name, ends in statuses.items()}
    self.started, self._over, self.most = [], {}, 0

  def start(self, name, arguments, log):
    self.started.append(name)
    status = self.statuses.get(name, [0]).pop(0)
    self._over[name] = status
    self.most = max(self.most, len(self._over))
    text = "error: bad input\n" if status == 1 else "Killed\n"
    log.write_text(text if status else "")

  def ended(self):
    over, self._over = self._over, {}
    return over


class SweepTest(FolderTest):
  def setUp(self):
    super().setUp()
    self.flags = self.folder / "flags"
    self.flags.mkdir()
    for stem in ("lfgp", "lfgp_transfer"):
      (self.flags / f"{stem}.flags").touch()

  def _jobs(self, algorithms, seeds=(0,), starts=(), arguments=()):
    jobs = jobs_lib.make_jobs(
      algorithms, ("stack", "bring"), seeds, self.folder, arguments, self.flags
    )
    starts_lib.chain(jobs, starts)
    return jobs

  def _run(self, jobs, engine, restarts=1):
    loop.Sweep(jobs, Index(self.folder), restarts).run(engine)
    return {job.name: job.state for job in jobs}

  def test_names_runs_after_flagfiles_and_seeds(self):
    jobs = self._jobs(("lfgp", "dac", "lfgp_move_object"), (0, 7),
                      arguments=["--x={runs}/{seed}"])  # fmt: skip
    names = [job.name for job in jobs]
    self.assertLen(names, 2 * 5)
    self.assertIn("lfgp_move_object_7", names)
    states = {job.name: job.state for job in jobs}
    self.assertEqual(states["dac_stack_0"], "no flagfile")
    self.assertEqual(states["lfgp_stack_0"], "waiting")
    self.assertContainsSubset(
      ["--config.seed=7", f"--x={self.folder}/7",
       f"--flagfile={self.flags}/lfgp.flags", "--config.main_task=stack",
       f"--run={self.folder}/lfgp_stack_7"],
      jobs[names.index("lfgp_stack_7")].train_arguments(),
    )  # fmt: skip

  def test_repeats_run_once_and_foreign_braces_stay(self):
    given = ["--a={task}", "--b={}", "--c={", "--d={seed}{runs.name}"]
    jobs = self._jobs(("lfgp", "lfgp_stack"), (0, 0), arguments=given)
    self.assertEqual(
      [job.name for job in jobs], ["lfgp_stack_0", "lfgp_bring_0"]
    )
    self.assertEqual(jobs[0].arguments, (*given[:3], "--d=0{runs.name}"))
    states = self._run(jobs, FakeEngine({}))
    self.assertEqual({*states.values()}, {"done"})

  def test_names_that_are_none_are_refused(self):
    for bad in ("", "../lfgp"):
      with self.assertRaisesRegex(ValueError, f"'{bad}' is no name"):
        self._jobs((bad,))

  def test_what_died_is_tried_again_and_bad_input_is_not(self):
    jobs = self._jobs(("lfgp", "dac"), (0, 1))
    engine = FakeEngine(
      {"lfgp_stack_0": [-9, 0], "lfgp_bring_0": [1], "lfgp_stack_1": [-9, -9]}
    )
    jobs[0].wall_s = 60  # of an earlier sweep
    states = self._run(jobs, engine)
    self.assertEqual(
      states,
      {
        "lfgp_stack_0": "done",
        "lfgp_bring_0": "failed",
        "lfgp_stack_1": "failed",
        "lfgp_bring_1": "done",
        "dac_stack_0": "no flagfile",
        "dac_bring_0": "no flagfile",
        "dac_stack_1": "no flagfile",
        "dac_bring_1": "no flagfile",
      },
    )
    self.assertEqual(engine.most, 2)
    _, rows = csv_files.read(self.folder / "index.csv")
    by_name = {row["name"]: row for row in rows}
    self.assertEqual(by_name["lfgp_stack_0"]["attempts"], "2")
    self.assertBetween(float(by_name["lfgp_stack_0"]["wall_s"]), 60, 70)
    self.assertEqual(by_name["lfgp_bring_0"]["message"], "error: bad input")
    self.assertEqual(by_name["lfgp_stack_1"]["message"],
                     "killed by SIGKILL")  # fmt: skip

  def test_what_another_sweep_finished_meanwhile_stays_done(self):
    here, there = (self._jobs(("lfgp_move_object",)) for _ in range(2))
    there[0].state, there[0].attempts = "done", 3
    Index(self.folder).write(there)
    here[0].state = "failed"
    Index(self.folder).write(here)
    _, (row,) = csv_files.read(self.folder / "index.csv")
    self.assertEqual((row["state"], row["attempts"]), ("done", "3"))

  def test_a_lock_not_released_yet_is_tried_again_after_a_rest(self):
    jobs = self._jobs(("lfgp_move_object",))
    engine = FakeEngine({"lfgp_move_object_0": [-9, 1, 0]})
    start = time.monotonic()
    with mock.patch.object(loop, "_REST", 0.5):
      states = self._run(jobs, engine, restarts=2)
    self.assertEqual(states, {"lfgp_move_object_0": "done"})
    self.assertLen(engine.started, 3)
    self.assertGreater(time.monotonic() - start, 0.5)

  def test_a_transfer_waits_for_its_source(self):
    start = "lfgp_transfer_stack:lfgp_move_object:config.from"
    algorithms = ("lfgp_transfer", "lfgp_move_object")
    jobs = self._jobs(algorithms, (0, 1), [start])
    self.assertIn(
      f"--config.from={self.folder}/lfgp_move_object_1",
      next(j for j in jobs if j.name == "lfgp_transfer_stack_1").arguments,
    )
    engine = FakeEngine({"lfgp_move_object_1": [1]})
    states = self._run(jobs, engine)
    self.assertEqual(states["lfgp_transfer_stack_0"], "done")
    self.assertEqual(states["lfgp_transfer_stack_1"], "held")
    self.assertLess(engine.started.index("lfgp_move_object_0"),
                    engine.started.index("lfgp_transfer_stack_0"))  # fmt: skip
    (alone, _) = self._jobs(("lfgp_transfer",), (0,), [start])
    self.assertEqual(alone.state, "held")
    with self.assertRaisesRegex(ValueError, "valid: TARGET:SOURCE"):
      self._jobs(("lfgp",), starts=["lfgp_stack"])

  def test_knows_what_is_done_by_index_or_evaluation(self):
    jobs = self._jobs(("lfgp",), (0, 1))
    for job in jobs:
      job.folder.mkdir()
      config = {"main_task": job.main_task, "env_steps": 100}
      (job.folder / "config.json").write_text(json.dumps(config))
    for job, step in ((jobs[0], 50), (jobs[1], 100)):
      (job.folder / "evaluation.csv").write_text(
        "env_step,task,episode,seed,success,steps_to_success,return\n"
        f"{step},{job.main_task},0,0,1,9,1.0\n"
      )
    jobs[2].state, jobs[2].wall_s = "done", 60
    index = Index(self.folder)
    index.write(jobs)
    again = self._jobs(("lfgp",), (0, 1))
    index.recall(again)
    self.assertEqual(
      [job.state for job in again], ["waiting", "done", "done", "waiting"]
    )
    self.assertEqual(again[2].wall_s, 60)
    self.assertIn("--resume", again[0].train_arguments())
    given = ["--preset=ral", "--config.demonstrations=d", "--config.env_steps="]
    same = self._jobs(
      ("lfgp",), (0, 1), arguments=[*given[:2], given[2] + "99"]
    )
    index.recall(same)
    self.assertEqual([j.state for j in same], [j.state for j in again])
    self.assertEqual(same[0].train_arguments()[2:], given[1:2])
    longer = self._jobs(("lfgp",), (0, 1), arguments=["--config.env_steps=101"])
    index.recall(longer)
    self.assertEqual({job.state for job in longer}, {"waiting"})
    self.assertEqual(
      longer[1].train_arguments(),
      [f"--run={longer[1].folder}", "--resume", "--config.env_steps=101"],
    )
    row = csv_files.read(index.path)[1][0]
    self.assertEqual((row["env_step"], row["success"]), ("50", "1.000"))
    index.write(self._jobs(("lfgp_new",)))
    self.assertLen(csv_files.read(index.path)[1], 6)  # theirs stay
    later = self._jobs(("lfgp",), (1,))
    start = "lfgp_bring:lfgp_stack:config.init_from"
    starts_lib.chain(later[1:], [start], index.done())
    self.assertEqual(later[1].state, "waiting")  # the index has its source
    index.path.write_text("question,verdict\nwhy,so\n")
    with self.assertRaisesRegex(ValueError, "index.csv is no sweep's"):
      index.recall(again)
