"""Draw which room of pendulum_sysid imports which, as a Mermaid diagram in DESIGN.md.

A room is a folder or a file of the package. The entrances open every room and are not drawn. An
arrow that other arrows imply is left out: a room may also import what its rooms import.

Run the program after a change of imports. With --check it writes nothing, and its exit status is 1
if the drawing is out of date.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from pathlib import Path

from program_options import make_parser

ROOT = Path(__file__).parents[1]
DESIGN = ROOT / "DESIGN.md"
BEGIN, END = "<!-- rooms: begin -->\n", "<!-- rooms: end -->\n"
PACKAGE = "pendulum_sysid"
ENTRANCES = {"__init__", "api", "cli"}

Imports = dict[str, set[str]]  # room -> the rooms that it imports


def list_imports(source: str) -> set[str]:
    """Return the absolute names that a source imports."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
    return names


def collect_imports(folder: Path) -> Imports:
    """Return which room of the package in a folder imports which, the entrances left out."""
    imports: Imports = {}
    for path in sorted(folder.glob("**/*.py")):
        room = path.relative_to(folder).with_suffix("").parts[0]
        if room not in ENTRANCES:
            names = (name.split(".") for name in list_imports(path.read_text(encoding="utf-8")))
            imported = {parts[1] for parts in names if parts[0] == PACKAGE and len(parts) > 1}
            imports.setdefault(room, set()).update(imported - ENTRANCES - {room})
    return imports


def collect_reached(imports: Imports, room: str) -> set[str]:
    """Return the rooms that a room imports, and those that these import, and so on.

    No room may reach itself; tests/test_architecture.py holds this.
    """
    return imports[room].union(*(collect_reached(imports, below) for below in imports[room]))


def draw_rooms(imports: Imports) -> str:
    """Return the diagram: an arrow points from a room to the room that it imports."""
    arrows = []
    for room, imported in sorted(imports.items()):
        implied = set().union(*(collect_reached(imports, below) for below in imported))
        arrows += [f"    {room} --> {below}" for below in sorted(imported - implied)]
    return "\n".join(["```mermaid", "flowchart TD", *arrows, "```", ""])


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the drawing, or check it; return the exit status."""
    parser = make_parser("draw_rooms", __doc__, "", "--check")
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    check = parser.parse_args(arguments).check
    design = DESIGN.read_text(encoding="utf-8")
    head, tail = design.split(BEGIN)[0], design.split(END)[1]
    drawing = draw_rooms(collect_imports(ROOT / "src" / PACKAGE / PACKAGE))
    current = head + BEGIN + drawing + END + tail
    if check:
        return int(current != design)
    DESIGN.write_text(current, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
