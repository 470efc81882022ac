"""No module of pendulum_rl_env imports itself through others."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

from support.paths import SRC

ROOT = SRC / "pendulum_rl_env"


def name_module(path: Path) -> str:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    return name.removesuffix(".__init__")


def find_imports(path: Path, modules: set[str]) -> set[str]:
    """Return the modules of the package that a file imports, under TYPE_CHECKING, too."""
    imports = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            imports |= names & modules or {node.module} & modules
    return imports


def test_the_modules_have_an_order_in_which_each_imports_only_those_before_it() -> None:
    paths = {name_module(path): path for path in (ROOT / "pendulum_rl_env").rglob("*.py")}
    graph = {name: find_imports(path, set(paths)) for name, path in paths.items()}
    assert sum(map(len, graph.values())) > 100  # the imports are seen
    assert len(list(TopologicalSorter(graph).static_order())) == len(paths)
