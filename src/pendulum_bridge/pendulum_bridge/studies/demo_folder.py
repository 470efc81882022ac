"""The folder of a demo: what it holds, and how an earlier demo makes room for the next."""

from __future__ import annotations

import itertools
import json
import shlex
from dataclasses import dataclass
from pathlib import Path

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object, write_atomically

SCHEMA = "pendulum_demo/1"
FACTS = "demo.json"
MARK = "nominal_twin.yaml"  # a demo's folder has it from the beginning


@dataclass(frozen=True)
class DemoFacts:
    """Hold what makes a demo again.

    seed: decides what is concealed.
    effects: number of concealed effects.
    options: all options but --out and --seed, as words of a command line.
    """

    seed: int
    effects: int
    options: tuple[str, ...]

    @property
    def command(self) -> str:
        """Return the command that makes the same demo again."""
        return f'make demo ARGS="{shlex.join(["--seed", str(self.seed), *self.options])}"'


def write_facts(facts: DemoFacts, out: Path) -> None:
    """Write what makes the demo again into its folder."""
    content = {
        "schema": SCHEMA,
        "seed": facts.seed,
        "effects": facts.effects,
        "again": facts.command,
    }
    write_atomically(out / FACTS, json.dumps(content, indent=2) + "\n")


def make_room(out: Path) -> Path | None:
    """Rename an earlier demo's folder after its seed; return its new name, None without a demo.

    Raises BadInputError when other files are in the way.
    """
    if out.exists() and not out.is_dir():
        raise BadInputError(f"--out: expected a folder, found the file {out}")
    if not out.is_dir() or not any(out.iterdir()):
        return None
    if not (out / MARK).is_file():
        raise BadInputError(
            f"--out: expected an empty folder or an earlier demo's, found other files in {out}"
        )
    kept = _choose_name(out)
    try:
        return out.rename(kept)
    except OSError as error:
        raise BadInputError(
            f"{out}: expected to rename the earlier demo to {kept}, found {error.strerror}: "
            "give another --out"
        ) from error


def _choose_name(out: Path) -> Path:
    """Return a free name beside a demo's folder: demo_seed_13, demo_seed_13_2, ..."""
    try:
        seed = str(read_json_object(out / FACTS, SCHEMA, "a demo")["seed"])
    except (BadInputError, KeyError):  # stopped before it was written, or made by an old version
        seed = "unknown"
    name = f"{out.name}_seed_{seed}"
    names = itertools.chain([name], (f"{name}_{k}" for k in itertools.count(2)))
    return next(path for name in names if not (path := out.with_name(name)).exists())
