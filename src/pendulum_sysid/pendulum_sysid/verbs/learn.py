"""The verb `learn`: the measured laws of a verdict become effects of the user's own."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from pendulum_sysid.errors import UnusableRecording, WrongUse
from pendulum_sysid.telling.effect_file import write_effect
from pendulum_sysid.telling.output_files import name_write_errors
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_sysid.verdict.json_form import decode_verdict
from pendulum_sysid.verdict.record import MeasuredLaw
from pendulum_twin.effects import BY_NAME
from pendulum_twin.files import read_json_object, write_atomically
from pendulum_twin.schemas import VERDICT


def run(arguments: argparse.Namespace) -> int:
    """Write a file for every law with a formula, print its path, and say how to use it."""
    path = Path(arguments.verdict)
    file = path / "verdict.json" if path.is_dir() else path
    verdict = decode_verdict(read_json_object(file, VERDICT, "a verdict"))
    if not verdict.measured_laws:
        raise UnusableRecording(
            f"{file}: expected measured laws, found none: only physics that no effect explains is "
            "measured"
        )
    texts, refused = _write_effects(verdict.measured_laws, arguments.name)
    if not texts:
        raise UnusableRecording("; ".join(refused))
    written = []
    for name, text in texts.items():
        target = Path(arguments.out) / f"{name}.py"
        with name_write_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(target, text)
        written.append(target)
    for sentence in refused:
        say(sentence)
    print_answer(
        arguments,
        lambda: {"effects": [str(path) for path in written], "left_out": refused},
        *written,
    )
    return ANSWERED


def _write_effects(
    laws: Sequence[MeasuredLaw], name: str | None
) -> tuple[dict[str, str], list[str]]:
    """Return name -> source of the laws that effects can hold, and why the others are left out.

    name: of the only effect; None for names after the laws. Raises WrongUse where another effect
    has the name, or several laws would share it.
    """
    texts, learned, refused = {}, [], []
    for law in laws:
        own = name or f"learned_{law.law}"
        if own in BY_NAME:
            raise WrongUse(f"--name: expected a name that no effect has, found {own}")
        try:
            texts[own] = write_effect(law, own)
            learned.append(law.law)
        except WrongUse as error:
            refused.append(str(error))
    if len(texts) < len(learned):
        raise WrongUse(
            "expected --name with a verdict that has one law with a formula, found "
            f"{len(learned)} ({', '.join(learned)}): leave --name out, and each effect is named "
            "after its law"
        )
    return texts, refused
