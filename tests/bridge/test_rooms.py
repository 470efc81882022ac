"""The folders of pendulum_bridge import one another in one direction only."""

import ast
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from support.paths import SRC

PACKAGE = "pendulum_bridge"
FOLDER = SRC / PACKAGE / PACKAGE
Graph = dict[str, set[str]]


def read_imports(path: Path) -> list[str]:
    """List the absolute modules that a file imports from."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    origins = [n.module or "" for n in nodes if isinstance(n, ast.ImportFrom) and not n.level]
    return origins + [a.name for n in nodes if isinstance(n, ast.Import) for a in n.names]


def draw_rooms(folder: Path) -> Graph:
    """Map each room to the other rooms that it imports; files in no folder are rooms too."""
    graph: Graph = defaultdict(set)
    for path in folder.rglob("*.py"):
        room = path.relative_to(folder).with_suffix("").parts[0]
        for origin in read_imports(path):
            package, *below = origin.split(".")
            if package == PACKAGE and below and below[0] != room:
                graph[room].add(below[0])
    return graph


def test_no_rooms_import_one_another_in_a_circle() -> None:
    graph = draw_rooms(FOLDER)
    assert graph["driver"] >= {"safety", "wire"}
    TopologicalSorter(graph).prepare()


def test_a_circle_is_found(tmp_path: Path) -> None:
    (tmp_path / "wire").mkdir()
    (tmp_path / "wire/link.py").write_text("from pendulum_bridge.safety.decide import decide\n")
    (tmp_path / "safety.py").write_text("from pendulum_bridge.wire import link\n")
    with pytest.raises(CycleError, match="cycle"):
        TopologicalSorter(draw_rooms(tmp_path)).prepare()


def test_drivers_and_players_know_no_study_and_no_node() -> None:
    graph = draw_rooms(FOLDER)
    for room in ("wire", "safety", "driver", "excitation"):
        assert not graph[room] & {"nodes", "studies", "emulator", "doctor", "view", "watch"}
