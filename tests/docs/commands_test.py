"""Commands, flags and paths that pages, flagfiles and help name: they exist."""

import collections
import itertools
import os
import re
import tomllib

from absl.testing import absltest, parameterized

from lfgp_dmc.launch import configs
from tests.docs import pages
from tests.launch import forked

_PAGES = ("README.md", "WORKSPACE.md", *(
  str(path.relative_to(pages.ROOT))
  for path in sorted((pages.ROOT / "docs").glob("*.md"))
))  # fmt: skip
_RUN_ELSEWHERE = "docs/own_task.md"  # on files that it makes first
_MOST = 2_000_000  # bytes of a picture
# Of pip, Ray and every absl command.
_FOREIGN = {"address", "head", "index-url", "flagfile", "help"}
# Between them they have every field of a group with kinds.
_KINDS = (
  {"scheduler": "q_table", "reward": "discriminator"},
  {"scheduler": "weighted_random_handcrafted", "reward": "examples"},
  {},
)
_PROJECT = tomllib.loads((pages.ROOT / "pyproject.toml").read_text())["project"]


def _texts() -> dict[str, str]:
  """Pages, flagfiles' comments and commands' help, by path; lines joined."""
  texts = {page: (pages.ROOT / page).read_text() for page in _PAGES}
  for path in sorted(pages.ROOT.glob("launch/flags/*.flags")):
    comments = re.findall("^# ?(.*\n)", path.read_text(), re.MULTILINE)
    texts[path.name] = "".join(comments)
  for path in sorted(pages.ROOT.glob("launch/*.py")):
    if "\ncli = " in (code := path.read_text()):
      texts[path.name] = code.split('"""')[1]
  return {name: re.sub(r"\\\n *", "", text) for name, text in texts.items()}


def _commands() -> dict[str, set[str]]:
  """Command -> lines of arguments, wherever they stand."""
  scripts = {
    name: target.partition(":")[0].rpartition(".")[2]
    for name, target in _PROJECT["scripts"].items()
  }
  found = collections.defaultdict(set)
  for where, text in _texts().items():
    if where == _RUN_ELSEWHERE:
      continue
    for name, line in re.findall(r"python launch/(\w+)\.py([^\n`#]*)", text):
      found[name].add(line)
    for name, line in re.findall(r"(lfgp-[a-z-]+)( --[^\n`#]*)", text):
      found[scripts[name]].add(line)
  return found


def _fields() -> set[str]:
  """Every setting, of any algorithm and kind."""
  found = set()
  for algorithm, kinds in itertools.product(configs.ALGORITHMS, _KINDS):
    kinds = {f"agent.{k}{configs.KIND}": kind for k, kind in kinds.items()}
    config = configs.make_config(algorithm, kinds=kinds)
    found |= dict(configs.flattened(config.to_dict())).keys()
  return found


def _parse(command: str, *lines: str):
  script = str(pages.ROOT / "tests/docs/parse.py")
  return forked.run([script, command, *lines], str(pages.ROOT), os.environ)


class CommandsTest(parameterized.TestCase):
  @parameterized.parameters(*_commands().items())
  def test_every_line_parses(self, command, lines):
    done = _parse(command, *sorted(lines))
    self.assertEqual(done.returncode, 0, done.stderr)

  @parameterized.parameters(
    ("train", "--config.agent.sheduler.xi=45", "did you mean"),
    ("train", "--flagfile=launch/flags/lost.flags", "lost.flags"),
    ("train", "--config.main_task=juggle", "config.main_task is 'juggle'"),
    (
      "collect_demonstrations",
      "--pears=9",
      "Unknown command line flag 'pears'",
    ),
  )
  def test_what_does_not_parse_is_seen(self, command, argument, message):
    done = _parse(command, argument)
    self.assertEqual(done.returncode, 1)
    self.assertIn(message, done.stderr)

  def test_every_flag_in_prose_exists(self):
    known = set(_FOREIGN)
    for path in pages.ROOT.glob("launch/**/*.py"):
      known.update(re.findall(r'DEFINE_\w+\(\s*"(\w+)"', path.read_text()))
    known |= {f"config.{field}" for field in _fields()}
    known |= {f"no{name}" for name in known}
    for where, text in _texts().items():
      named = re.findall(r"(?<![\w-])--([a-z][\w.-]*\w)", text)
      self.assertEmpty(set(named) - known, where)


class ReadmeTest(absltest.TestCase):
  def test_the_readmes_code_runs(self):
    names = pages.run("../README.md")
    self.assertTrue(names["timestep"].last())
    self.assertEqual(names["observation"].shape, (59,))


class PathsTest(parameterized.TestCase):
  @parameterized.parameters(*_PAGES)
  def test_every_path_exists(self, page):
    text = (pages.ROOT / page).read_text()
    rooms = "agents|docs|launch|lfgp_dmc|results|tasks|tests|videos"
    named = re.findall(rf"`((?:{rooms})/[a-z0-9_/.]+)`", text)
    for name in named:
      self.assertTrue((pages.ROOT / name).exists(), name)
    linked = re.findall(r"\]\((?!https?:)([^)#]+)", text)
    for name in linked:
      path = (pages.ROOT / page).parent / name
      self.assertTrue(path.exists(), name)

  def test_pictures_are_small(self):
    pictures = {
      (pages.ROOT / page).parent / name
      for page in _PAGES
      for name in re.findall(
        r"!\[[^]]*\]\(([^)]+)\)", (pages.ROOT / page).read_text()
      )
    }
    self.assertGreater(len(pictures), 10)
    for path in pictures:
      self.assertBetween(path.stat().st_size, 1, _MOST, path)


if __name__ == "__main__":
  absltest.main()
