"""Draw who imports whom, as a Mermaid diagram between two marks of DESIGN.md.

Run as `python docs/draw_rooms.py` after a change of imports; `--check` only says whether the
drawing is current (exit status 1 when it is not).
"""

from __future__ import annotations

import argparse
import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
DESIGN = ROOT / "DESIGN.md"
BEGIN, END = "<!-- rooms: begin -->\n", "<!-- rooms: end -->\n"
FOUNDATION, SYSID = "pendulum_twin", "pendulum_sysid"


def name_module(path: Path) -> str:
    """Name a file of src/<package>/<package>/ as Python imports it."""
    parts = path.relative_to(ROOT / "src").with_suffix("").parts[1:]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def list_imports(source: str) -> set[str]:
    """Return the absolute names of modules that a source imports."""
    modules = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            modules.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules.update(f"{node.module}.{alias.name}" for alias in node.names)
    return modules


def find_room(module: str) -> str:
    """Return the room of a module: of pendulum_sysid the folder or file, else the package."""
    parts = module.split(".")
    return parts[1] if parts[0] == SYSID and len(parts) > 1 else parts[0]


def count_imports() -> Counter[tuple[str, str]]:
    """Return how many modules of a room import another room, (importer, imported) -> count."""
    arrows: Counter[tuple[str, str]] = Counter()
    for path in sorted((ROOT / "src").glob("*/pendulum_*/**/*.py")):
        module = name_module(path)
        imported = {
            find_room(name) for name in list_imports(path.read_text()) if name.startswith("pend")
        }
        if module != SYSID:
            arrows.update((find_room(module), room) for room in imported - {find_room(module)})
    return arrows


def draw_rooms(arrows: Counter[tuple[str, str]]) -> str:
    """Return a Mermaid diagram; an arrow points from the importer to the imported room."""
    lines = ["```mermaid", "flowchart TD"]
    lines += [
        f"    {importer} -- {count} --> {imported}"
        for (importer, imported), count in sorted(arrows.items())
        if imported != FOUNDATION or importer.startswith("pendulum")
    ]
    return "\n".join([*lines, "```", ""])


def main() -> int:
    """Write the drawing, or check it; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    text = DESIGN.read_text()
    head, tail = text.split(BEGIN)[0], text.split(END)[1]
    new = head + BEGIN + draw_rooms(count_imports()) + END + tail
    if parser.parse_args().check:
        return int(new != text)
    DESIGN.write_text(new)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
