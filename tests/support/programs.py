"""The programs of the four packages, as their setup.py files name them."""

import ast

from support.paths import ROOT


def list_executables() -> dict[str, str]:
    """Return name and entry point ("module:function") of every program."""
    programs: dict[str, str] = {}
    for path in ROOT.glob("src/*/setup.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "EXECUTABLES":
                programs |= ast.literal_eval(node.value)
    return programs
