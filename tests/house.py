"""The numbers of the house: how the code base is laid out and named.

Run as `python tests/house.py`; `tests/test_names.py` keeps the numbers from getting worse.
"""

import argparse
import ast
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SRC, TESTS = ROOT / "src", ROOT / "tests"
COLUMNS = 99
BANNED = ("one", "found", "told", "asked", "made", "held")
VERBS = """
    abandon absorb accept act activate add advance announce apply ask average become begin bind
    brake break bring build carry catch check choose claim classify clear clip close collect
    combine compare compile complain compose compute conceal confirm connect convert correct
    create cut deactivate decide declare decode deliver derive describe destroy detect diagnose
    differentiate discard discover distort drain draw drop encode enter evaluate examine excite
    explain export extend extrapolate fail fill find finish fit flush follow forget format freeze
    gather get give glide go greet grow halve hear hide hold identify ignore import inspect
    integrate interpolate interrupt join judge keep latch lay learn leave let linearise listen
    load localise locate look map match measure meet minimise move need note notice nudge observe
    offer open pack parse pass pause perform perturb pick play predict prepare press print propose
    prove prune publish push put quote reach read receive recover reduce refine refresh refuse
    register remember remove render replace replay represent resample resolve retime round run
    save say search select send serve set settle shake shorten show simulate skip smooth solve
    speak spin split stack start stop subscribe subtract suggest summarise summarize survey take
    tell thin track train turn undo unpack unwrap vary wait watch wrap write
"""
# Verbs when a word follows: `name_effects`, `list_samples`
NOUNS_ALONE = """
    answer balance call change command control cost count delay design end exchange filter
    guard hand limit list log make name order pair plan plot point rank rate record report reset
    reward sample scale score share stage step swing trace trust
"""
QUESTIONS = ["is", "has", "can", "may", "does", "follows", "needs", "wants"]


@dataclass(frozen=True)
class Package:
    """Hold the numbers of one package.

    functions, verbs: functions and methods, and those whose name begins with a verb or asks a
        question; without properties and methods that Python calls.
    banned: places where a banned name is bound.
    long_lines: lines over 99 columns.
    """

    name: str
    functions: int
    verbs: int
    banned: int
    long_lines: int


def measure_package(name: str) -> Package:
    """Return the numbers of a package under src."""
    texts = [path.read_text() for path in sorted((SRC / name).glob("**/*.py"))]
    trees = [ast.parse(text) for text in texts]
    functions = [function for tree in trees for function in list_functions(tree)]
    return Package(
        name,
        functions=len(functions),
        verbs=sum(begins_with_verb(function) for function in functions),
        banned=sum(name in BANNED for tree in trees for name in list_bound_names(tree)),
        long_lines=sum(len(line) > COLUMNS for text in texts for line in text.splitlines()),
    )


def list_functions(tree: ast.AST) -> Iterator[str]:
    """Yield the names of all functions but properties, `main`, and methods that Python calls."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
            is_property = any("property" in decorator for decorator in decorators)
            if not (is_property or node.name.startswith("__") or node.name == "main"):
                yield node.name


def begins_with_verb(function: str) -> bool:
    """Return whether a function's name begins with a verb, or asks a question as `is_right`."""
    first, *others = function.strip("_").split("_")
    return first in VERBS.split() or bool(others and first in NOUNS_ALONE.split() + QUESTIONS)


def list_bound_names(tree: ast.AST) -> Iterator[str]:
    """Yield every name that is bound: assigned, an argument, an alias, caught, defined."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.alias):
            yield node.asname or ""
        elif isinstance(node, ast.ExceptHandler):
            yield node.name or ""
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name


def list_numbers(path: Path) -> Iterator[str]:
    """Yield the names of a module's constants that are numbers, or tuples of numbers."""
    for node in ast.parse(path.read_text()).body:
        target = node.targets[0] if isinstance(node, ast.Assign) else None
        if (
            isinstance(target, ast.Name)
            and target.id.strip("_").isupper()
            and is_number(node.value)
        ):
            yield target.id


def is_number(node: ast.expr) -> bool:
    """Return whether an expression is arithmetic on numbers alone, or a tuple of such."""
    parts = list(ast.walk(node))
    arithmetic = (ast.Constant, ast.Tuple, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop)
    return all(isinstance(part, (*arithmetic, ast.expr_context)) for part in parts) and all(
        isinstance(part.value, int | float) and not isinstance(part.value, bool)
        for part in parts
        if isinstance(part, ast.Constant)
    )


def count_imported(module: str) -> int:
    """Return how many of our own modules a fresh interpreter imports with a module."""
    code = f"import sys, {module}; print(*(m for m in sys.modules if m.startswith('pendulum_')))"
    path = os.pathsep.join(str(folder) for folder in SRC.glob("pendulum_*"))
    result = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return len(result.stdout.split())


def count_siblings() -> tuple[Path, int]:
    """Return the folder under src with the most Python files beside each other, and how many."""
    siblings = Counter(path.parent for path in SRC.glob("**/*.py"))
    return siblings.most_common(1)[0]


def count_tests() -> int:
    """Return the number of test functions, each counted once for all its parameters."""
    trees = (ast.parse(path.read_text()) for path in TESTS.glob("**/test_*.py"))
    return sum(name.startswith("test_") for tree in trees for name in list_functions(tree))


def main() -> None:
    """Print the numbers of the house."""
    argparse.ArgumentParser(prog="house", description=__doc__).parse_args()
    packages = [measure_package(path.name) for path in sorted(SRC.glob("pendulum_*"))]
    for package in packages:
        share = 100 * package.verbs / package.functions
        print(
            f"{package.name}: {package.functions} functions, {share:.0f} % begin with a verb; "
            f"{package.banned} banned names; {package.long_lines} lines over {COLUMNS} columns"
        )
    sysid = SRC / "pendulum_sysid" / "pendulum_sysid"
    numbers = {path: [*list_numbers(path)] for path in sysid.glob("**/*.py")}
    folder, siblings = count_siblings()
    print(
        f"modules imported for `sysid diagnose`: {count_imported('pendulum_sysid.verbs.diagnose')}"
    )
    print(f"Python files in the largest folder, {folder.relative_to(SRC)}: {siblings}")
    print(f"named numbers of pendulum_sysid: {sum(map(len, numbers.values()))}")
    print(
        f"named numbers that decide (decisions.py): {len(numbers.get(sysid / 'decisions.py', []))}"
    )
    print(f"test functions: {count_tests()}")


if __name__ == "__main__":
    main()
