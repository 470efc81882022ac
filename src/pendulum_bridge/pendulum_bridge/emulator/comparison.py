"""The seal beside the verdict: what was concealed and what was found, as a table for a person."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any

from pendulum_bridge.emulator.seal import Concealed
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object
from pendulum_twin.rig import UNITS, Rig

SCHEMA = "pendulum_verdict/1"
ROW = "  {:<26} {:>10} {:>10}   {:<46} {}"


class Answer(Enum):
    """How a verdict compares with the seal; the value is the sentence."""

    RIGHT = "The diagnosis is right: it names what was concealed, and nothing else."
    UNDECIDED = (
        "The diagnosis is undecided: what was concealed is among what it cannot tell apart."
    )
    PARTLY = "The diagnosis is partly right: it names some of it, and misses or adds some."
    WRONG = "The diagnosis is wrong: it names nothing of what was concealed."


def read_verdict(path: str | Path) -> dict[str, Any]:
    """Return the verdict in a file; raise BadInputError when it is none."""
    return read_json_object(Path(path), SCHEMA, "a verdict")


def answer(concealed: Concealed, verdict: Mapping[str, Any]) -> Answer:
    """Return how the verdict compares with the truth, by the names alone."""
    true = set(concealed.effects)
    named = {
        each["effect"]: set(each["cannot_be_told_from"]) for each in verdict["missing_physics"]
    }
    if true == set(named):
        return Answer.RIGHT
    covered = {
        name
        for name in true
        if any(name == other or name in ties for other, ties in named.items())
    }
    if covered == true and len(named) == len(true):
        return Answer.UNDECIDED
    return Answer.PARTLY if true & set(named) else Answer.WRONG


def table(concealed: Concealed, nominal: Rig, verdict: Mapping[str, Any]) -> str:
    """Return the whole comparison; raise BadInputError when the verdict lacks what the contract says it has."""
    try:
        lines = [
            ROW.format("physics", "concealed", "", "found (95 % interval)", "").rstrip(),
            *_physics(concealed, verdict["missing_physics"]),
            "",
            ROW.format("rig parameters", "nominal", "true", "found (95 % interval)", "").rstrip(),
            *_parameters(concealed.rig, nominal, verdict["rig_parameters"]),
            "",
            _scores(verdict["fit"]),
            f"Verdict ({verdict['outcome']}): {verdict['sentence']}",
            *[f"Masking: {sentence}." for sentence in verdict.get("masking", [])],
            answer(concealed, verdict).value,
        ]
    except (KeyError, TypeError, AttributeError) as error:
        raise BadInputError(
            f"verdict: expected what {SCHEMA} holds, found {error!r} missing or odd"
        ) from error
    return "\n".join(lines)


def _physics(concealed: Concealed, missing: list[Mapping[str, Any]]) -> list[str]:
    found = {each["effect"]: each for each in missing}
    lines = [] if concealed.effects or found else ["  none concealed, none found"]
    for name, values in concealed.effects.items():
        lines.append(f"  {name}: {_called(name, found)}")
        parameters = found.get(name, {}).get("parameters", {})
        lines += [
            _row(key, f"{value:.4g}", "", parameters.get(key), value)
            for key, value in values.items()
        ]
    for name in found.keys() - concealed.effects.keys():
        lines.append(f"  {name}: was not concealed")
        lines += [
            _row(key, "-", "", value, None) for key, value in found[name]["parameters"].items()
        ]
    return lines


def _called(name: str, found: Mapping[str, Mapping[str, Any]]) -> str:
    if name in found:
        ties = found[name]["cannot_be_told_from"]
        return "named" + (f" (cannot be told from {', '.join(ties)})" if ties else "")
    tied = [other for other, each in found.items() if name in each["cannot_be_told_from"]]
    return (
        f"not named, but {tied[0]}, which this recording cannot tell from it"
        if tied
        else "not named"
    )


def _parameters(true: Rig, nominal: Rig, found: Mapping[str, Mapping[str, Any]]) -> list[str]:
    lines = []
    for key, value in true.to_mapping().items():
        before = getattr(nominal, key)
        if key in found or value != before:
            given = found.get(key)
            shown = (
                None
                if given is None
                else {**given, "value": given["after"], "unit": given.get("unit", UNITS[key])}
            )
            lines.append(_row(key, f"{before:.4g}", f"{value:.4g}", shown, value))
    return lines


def _row(
    key: str, first: str, second: str, found: Mapping[str, Any] | None, true: float | None
) -> str:
    """Return one line: found is a value with its interval, or None."""
    if found is None:
        return ROW.format("  " + key, first, second, "-", "").rstrip()
    shown = f"{found['value']:.4g} [{found['low']:.4g}, {found['high']:.4g}] {found['unit']}"
    if not found.get("identifiable", True):
        return ROW.format("  " + key, first, second, shown, "not identifiable")
    return ROW.format("  " + key, first, second, shown, _judged(found, true)).rstrip()


def _judged(found: Mapping[str, Any], true: float | None) -> str:
    if true is None:
        return ""
    if found["low"] <= true <= found["high"]:
        return "right"
    return (
        f"off by {100 * (found['value'] / true - 1):+.2g} %"
        if true
        else f"off by {found['value']:+.2g}"
    )


def _scores(fit: Mapping[str, Any]) -> str:
    held_out = fit["held_out"]
    return (
        f"Misfit in stretches that no fit has seen: {held_out['before']:.4g} before, {held_out['after']:.4g} after "
        f"({fit['unit']}; noise floor {fit['noise_floor']:.4g})"
    )
