"""Effects of the user's own: from folders, and from installed packages.

A folder holds files like those of `pendulum_twin/effects`, each with an `EFFECT`. Folders stand in
the environment variable PENDULUM_EFFECTS, separated as in PATH, so that every program and each of
its worker processes knows the same effects; `sysid --effects FOLDER` sets it. A package offers
effects under the entry point group `pendulum_twin.effects`.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterable, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from pendulum_twin.errors import BadInputError

if TYPE_CHECKING:  # the catalogue imports this module, and is read after `take_effects_option`
    from pendulum_twin.effects.effect import Effect

VARIABLE = "PENDULUM_EFFECTS"
GROUP = "pendulum_twin.effects"
OPTION = "--effects"


def list_effect_folders() -> list[str]:
    """Return the user's folders, in the order in which they are read."""
    return [folder for folder in os.environ.get(VARIABLE, "").split(os.pathsep) if folder]


def list_effect_files() -> list[Path]:
    """Return the files of the user's folders, in the order in which they are read.

    Raises BadInputError for a folder that is not there or holds no effect.
    """
    files: list[Path] = []
    for folder in list_effect_folders():
        own = sorted(path for path in Path(folder).glob("*.py") if path.name[0] not in "_.")
        if not own:
            raise BadInputError(
                f"{folder}: expected a folder with effects (Python files with EFFECT), found none"
            )
        files += own
    return files


def load_user_effects(built_in: Iterable[Effect]) -> tuple[Effect, ...]:
    """Return the effects of folders and packages; raise BadInputError for what is no effect."""
    effects = [_read_effect(path) for path in list_effect_files()]
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        effects.append(_get_effect(point.load(), f"entry point {point.name}"))
    names = {effect.name for effect in built_in}
    for effect in effects:
        if effect.name in names:
            raise BadInputError(
                f"{effect.name}: expected a name that no other effect has, found it twice"
            )
        names.add(effect.name)
    return tuple(effects)


def load_or_stop(built_in: Iterable[Effect]) -> tuple[Effect, ...]:
    """Return the user's effects; end the program with a sentence and status 2 for a wrong one."""
    try:
        return load_user_effects(built_in)
    except BadInputError as error:
        program = Path(sys.argv[0]).stem
        name = program if program.isidentifier() else "effects"  # such as -c of Python
        print(f"{name}: {error}", file=sys.stderr)
        raise SystemExit(2) from error


def _read_effect(path: Path) -> Effect:
    spec = importlib.util.spec_from_file_location(f"pendulum_user_effects.{path.stem}", path)
    assert spec is not None and spec.loader is not None  # of a Python file
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a user's file raises
        raise BadInputError(
            f"{path}: expected a Python file that can be read, found "
            f"{type(error).__name__}: {error}"
        ) from error
    return _get_effect(module, str(path))


def _get_effect(source: object, where: str) -> Effect:
    from pendulum_twin.effects.effect import Effect

    effect = source.__dict__.get("EFFECT") if isinstance(source, ModuleType) else source
    if not isinstance(effect, Effect):
        raise BadInputError(f"{where}: expected EFFECT, an Effect, found it missing")
    return effect


def take_effects_option(arguments: Sequence[str]) -> list[str]:
    """Return a command line without its `--effects FOLDER`, which goes into the environment.

    The catalogue must not be imported yet. Raises BadInputError for an option without a folder.
    """
    rest, folders = [], []
    words = iter(arguments)
    for word in words:
        if word != OPTION and not word.startswith(f"{OPTION}="):
            rest.append(word)
            continue
        folder = word.partition("=")[2] or next(words, "")
        if not folder:
            raise BadInputError(f"{OPTION}: expected a folder with effects, found none")
        folders.append(str(Path(folder).resolve()))
    if folders:
        known = os.environ.get(VARIABLE)
        os.environ[VARIABLE] = os.pathsep.join([*folders, *([known] if known else [])])
    return rest
