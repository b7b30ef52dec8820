"""Bad input to the commands: one clear line, and nothing left behind."""

import os
import pathlib
import subprocess
import sys
from unittest import mock

from lfgp_dmc.launch import command
from tests.fixtures import FolderTest
from tests.launch import fixtures

_POLICIES = pathlib.Path(__file__).parents[2] / "results" / "policies"
# Script, arguments, what the message says.
_BAD = (
  ("train.py --config.agent.sheduler.xi=5", "did you mean --config.agent."),
  ("train.py --flagfile=no.flags", "error: Unable to open flagfile"),
  ("train.py --flagfile=no.flags", "no.flags'; in "),
  ("train.py --flagfile=no.flags", "lfgp_few.flags"),
  ("train.py --config.seed=many", "flag --config.seed=many"),
  ("train.py --config.threads=9999999", "config.threads is 9999999; valid:"),
  ("train.py --resume", "--resume needs --run"),
  ("train.py --resume --run=no/run", "no run folder no/run"),
  ("evaluate.py stack", "unexpected argument 'stack'"),
  ("evaluate.py", "give one of --run=FOLDER and --expert=scripted"),
  ("evaluate.py --run=no/run", "no run folder no/run"),
  ("evaluate.py --expert=scripted --tasks=juggle", "unknown juggle; valid:"),
  ("evaluate.py --run=no/run --control_hz=5", "--control_hz goes with --exp"),
  ("evaluate.py --expert=mine", "should be one of <scripted>"),
  ("evaluate.py --expert=scripted --episodes=0", "not a positive integer"),
  ("render_policy.py --expert=scripted --task=juggle", "valid: stack, "),
  ("render_policy.py --run=a --control_hz=5", "--control_hz goes with --expe"),
  ("render_policy.py --run=a --what=reset", "--what=reset shows the world"),
  ("render_policy.py --run=a --what=strips --task=lift", "--task goes with"),
  (
    "render_policy.py --expert=scripted --what=strips --grid=2x2",
    "--grid does nothing with --what=strips",
  ),
  (
    "render_policy.py --what=reset --until_success",
    "--until_success does nothing with --what=reset",
  ),
  ("render_policy.py --expert=scripted --height=99999", "4320"),
  ("render_policy.py --expert=scripted --output=a.avi", "valid: .mp4, .gif,"),
  (
    "evaluate.py --expert=scripted --output=a_file/b",
    "a_file/b/evaluation.csv",
  ),
  ("render_policy.py --expert=scripted --output=a_file/b.mp4", "a_file/b.mp4"),
  ("plot.py --runs=no/run --output=a_file", "Not a directory"),
  ("benchmark.py --output=a_file/b.csv", "a_file/b.csv"),
  ("train.py --run=a_file/b", "a_file/b/config.json"),
  ("view.py --task=juggle", "--task=juggle is unknown; valid: stack"),
  ("view.py --task=stack", "the viewer needs a display"),
  ("plot.py", "give one of --run=FOLDER, --runs=FOLDER,... and --attempts="),
  ("plot.py --run=a --runs=b", "give one of --run=FOLDER, --runs=FOLDER,..."),
  ("plot.py --run=no/run", "no run folder no/run"),
  ("plot.py --run=.", ". is not a run: it has no config.json"),
  ("plot.py --run=a --quantity=return", "--quantity goes with --runs"),
  ("plot.py --attempts=no.csv", "No such file or directory: 'no.csv'"),
  ("plot.py --runs=no/run", "no run folder no/run"),
  ("benchmark.py --tasks=juggle", "--tasks=juggle is unknown"),
  ("sweep.py --seeds=a", "--seeds: invalid literal"),
  ("sweep.py --algorithms=lfgp,sorcery", "flags/sorcery.flags; see --dry_run"),
  ("evaluate.py --expert=scripted --workers=9999", "in the range [0, 4096]"),
  ("sweep.py --start_from=a", "valid: TARGET:SOURCE"),
  ("sweep.py --start_from=lfgp:a:config.init_from", "valid: a TARGET with its"),
  ("plot.py --runs=a --estimate=iqm", "--estimate goes with --figure=main|mul"),
  (
    "benchmark.py --what=bars --preset=few",
    "--preset does nothing with --what=bars",
  ),
  (
    "benchmark.py --what=environment --seconds=9",
    "--seconds does nothing with --what=environment",
  ),
  ("benchmark.py --what=learner --config.algorithm=bc", "bc does not act"),
  (
    "benchmark.py --config.environment=lfgp_dmc.toy:PointEnvironment",
    "benchmarks are of the block tasks",
  ),
  ("check_demonstrations.py", "--dataset is not set"),
  ("check_demonstrations.py --dataset=no", "no dataset folder no"),
  ("check_demonstrations.py --dataset=.", "no .hdf5 file in .; it holds: a_fi"),
  ("check_demonstrations.py --dataset=a_file", "a_file is a file; valid: the"),
  ("check_demonstrations.py --dataset=no --strip=a.gif", "valid: a new .png"),
  (
    "check_demonstrations.py --dataset=no --environment=no:thing",
    "No module named 'no'",
  ),
  (
    "check_demonstrations.py --dataset=no --environment=a:b --camera_size=64",
    "--camera_size is of the block tasks",
  ),
  ("demo.py --stored=missing", "no run folder missing"),
  (
    f"demo.py --stored={_POLICIES / 'pixels_stack'}",
    "valid: a policy of the block tasks' 59 floats",
  ),
  ("demo.py --preset=quick", "unknown preset 'quick'; valid: paper"),
)
_COLLECTION = (
  ("--output=new --task=juggle", "--task=juggle: value should be one of <sta"),
  ("--output=new --tasks=insert", "--tasks=insert is unknown; valid: stack, "),
  ("--output=new --collection=film", "one of <reset|play>"),
  ("--output=new --pairs_per_task=0", "0 is not a positive integer"),
  ("--output=new --final_pairs=-1", "-1 is not a non-negative integer"),
  (
    "--output=new --attempts_per_task=5 --pairs_per_task=9",
    "--attempts_per_task=5; valid: 0 with --pairs_per_task",
  ),
  ("--output=new --keep_longest_of=0", "0 is not a positive integer"),
  ("--output=new --keep_longest_of=2 --collection=play", "valid: 1 with"),
  ("--output=new --control_hz=7", "--control_hz=7 is unknown; valid: 20, 10"),
  ("--output=new --seed=-1", "-1 is not an integer in the range [0, 9223372"),
  (f"--output=new --seed={1 << 64}", "is not an integer in the range"),
  ("--output=new --workers=-1", "-1 is not an integer in the range [0, 4096]"),
  ("--output=new --expert=no/run", "no run folder no/run"),
  ("", "--output is not set"),
  ("--output=old", "--output=old exists; valid: a new folder"),
  ("--output=a_file/b", "a_file/b"),
)


class ArgumentsTest(FolderTest):
  def test_home_folders_are_expanded_in_flagfiles_too(self):
    (self.folder / "my.flags").write_text("--runs=~/a,~/b~c\n")
    with mock.patch.dict(os.environ, HOME=str(self.folder / "home")):
      done = fixtures.call("plot.py --flagfile=my.flags", self.folder)
    self.assertEqual(
      done.stderr, f"error: no run folder {self.folder}/home/a\n"
    )

  def test_a_locale_that_cannot_hold_a_path(self):
    line = "evaluate.py --expert=scripted --run=runs/\udcc3\udcb6"
    variables = {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}
    with mock.patch.dict(os.environ, variables):
      done = fixtures.call(line, self.folder, fresh=True)
    self.assertEqual(done.returncode, 1)
    self.assertIn(r"error: --run=runs/\udcc3\udcb6 is not text", done.stderr)
    self.assertEqual(done.stderr.count("\n"), 1)

  def test_a_pipe_that_closes_ends_the_help(self):
    script = pathlib.Path(command.__file__).with_name("train.py")
    for unbuffered in ("1", ""):
      read, write = os.pipe()
      os.close(read)
      done = subprocess.run(
        [sys.executable, script, "--help"],
        stdout=write,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
      )
      os.close(write)
      self.assertEqual((done.returncode, done.stderr), (1, b""))


class BadInputTest(FolderTest):
  def test_is_told_in_a_line_and_leaves_nothing(self):
    folder = self.folder
    (folder / "old").mkdir()
    (folder / "a_file").touch()
    collect = "collect_demonstrations.py"
    of_collection = ((f"{collect} {line}", said) for line, said in _COLLECTION)
    for line, message in (*_BAD, *of_collection):
      with self.subTest(line):
        done = fixtures.call(line, folder)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(message, done.stderr)
        self.assertRegex(done.stderr, r"\Aerror: .*\n\Z")
    self.assertCountEqual(os.listdir(folder), ["old", "a_file"])
    self.assertEmpty(os.listdir(folder / "old"))
