"""Imports run one way: launch -> agents and tasks -> lfgp_dmc."""

import ast
import pathlib
import subprocess
import sys

from absl.testing import parameterized

_ROOT = pathlib.Path(__file__).resolve().parents[1]
_FACADE = pathlib.Path("lfgp_dmc/__init__.py")
_SIMULATOR = {"mujoco", "dm_control"}
_FORBIDDEN = {
  "lfgp_dmc": {"tasks", "agents", "launch", "torch", *_SIMULATOR},
  "tasks": {"agents", "launch", "torch"},
  "agents": {"tasks", "launch", *_SIMULATOR},
  "launch": set(),
}
# Parts of the import name `lfgp_dmc` that are rooms of their own.
_COMMANDS = [
  path.stem
  for path in sorted((_ROOT / "launch").glob("*.py"))
  if "\ncli = " in path.read_text(encoding="utf-8")
]
_PARTS = [[room] for room in _FORBIDDEN if room != "lfgp_dmc"]


def _room(module: str) -> str:
  """The room of a dotted import name, or a stranger's top-level package."""
  first, *rest = module.split(".")
  return rest[0] if first == "lfgp_dmc" and rest[:1] in _PARTS else first


def _roots(node: ast.AST) -> set[str]:
  """Rooms and top-level packages that an import statement names."""
  if isinstance(node, ast.Import):
    return {_room(alias.name) for alias in node.names}
  if isinstance(node, ast.ImportFrom) and not node.level:
    return {_room(f"{node.module}.{alias.name}") for alias in node.names}
  return set()


def _imports(source: str) -> tuple[set[str], set[str]]:
  """What a module imports: everywhere, and inside functions only."""
  tree = ast.parse(source)
  functions = (ast.FunctionDef, ast.AsyncFunctionDef)
  lazy_nodes = {
    inner
    for node in ast.walk(tree)
    if isinstance(node, functions)
    for inner in ast.walk(node)
  }
  lazy, eager = set(), set()
  for node in ast.walk(tree):
    (lazy if node in lazy_nodes else eager).update(_roots(node))
  return eager, lazy


class LayeringTest(parameterized.TestCase):
  @parameterized.parameters(*_FORBIDDEN)
  def test_room_imports_only_downwards(self, room):
    forbidden = _FORBIDDEN[room] | {"tests"}
    for path in sorted((_ROOT / room).rglob("*.py")):
      name = path.relative_to(_ROOT)
      eager, lazy = _imports(path.read_text(encoding="utf-8"))
      if name == _FACADE:  # may reach up, but only inside functions
        lazy -= {"tasks", "agents"}
      with self.subTest(str(name)):
        self.assertEmpty((eager | lazy) & forbidden)

  def test_every_import_is_seen(self):
    eager, lazy = _imports(
      "import a.b\nif x:\n  from c import d\nclass E:\n  def f(self):\n"
      "    import g\n    def h():\n      from i.j import k\n"
      "    from lfgp_dmc import tasks\n    import lfgp_dmc.agents.bc\n"
    )
    self.assertEqual((eager, lazy), ({"a", "c"}, {"g", "i", "tasks", "agents"}))

  @parameterized.parameters(
    (
      "lfgp_dmc, lfgp_dmc.runs.loop, lfgp_dmc.acting.evaluation",
      {"torch", *_SIMULATOR, "lfgp_dmc.tasks", "lfgp_dmc.agents"},
    ),
    (
      "lfgp_dmc.tasks.experts, lfgp_dmc.tasks.mirror,"
      "lfgp_dmc.tasks.published_examples",
      {"torch", *_SIMULATOR},
    ),
    ("lfgp_dmc.tasks.environment", {"torch"}),
    ("lfgp_dmc.agents.policy", {"torch", *_SIMULATOR}),
    ("lfgp_dmc", {"matplotlib", "scipy", "h5py", "pydantic"}),
    *(  # as for --help
      (f"lfgp_dmc.launch.{name}", {"torch", "scipy", *_SIMULATOR})
      for name in _COMMANDS
    ),
    ("lfgp_dmc.launch.train", {"matplotlib", "tensorboard", "h5py"}),
  )
  def test_importing_does_not_load(self, modules, heavy):
    code = (
      f"import sys, {modules}\n"
      f"found = {heavy} & set(sys.modules)\n"
      "sys.exit(str(found) if found else 0)"
    )
    done = subprocess.run(
      [sys.executable, "-c", code], cwd=_ROOT, capture_output=True, text=True
    )
    self.assertEqual(done.returncode, 0, done.stderr)

  def test_commands_load_the_simulator_after_its_backend_is_chosen(self):
    for path in sorted((_ROOT / "launch").rglob("*.py")):
      eager, _ = _imports(path.read_text())
      with self.subTest(path.name):
        self.assertEmpty(eager & {"tasks", *_SIMULATOR})
