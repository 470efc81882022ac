"""The seal beside the verdict: what was concealed and what the diagnosis found, as a table.

The judge is the proof's own (`pendulum_sysid.studies.proof`); this module prints what it decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted import BY_NAME as UNLISTED
from pendulum_sysid.studies.proof.judge_trial import answer_of
from pendulum_sysid.studies.proof.names import judged
from pendulum_sysid.studies.proof.records import How, Names, Sealed, Size, Unlisted
from pendulum_sysid.studies.proof.sizes import RIG, effect_sizes, mass_scale, rig_sizes
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object
from pendulum_twin.rig import UNITS, Rig

SCHEMA = "pendulum_verdict/1"
ROW = "  {:<26} {:>10} {:>10}   {:<46} {}"
SENTENCES = {
    How.RIGHT: "The diagnosis is right: it names what was concealed, and nothing else.",
    How.TIED: (
        "The diagnosis is undecided: what was concealed is among what it cannot tell apart."
    ),
    How.INCOMPLETE: "The diagnosis is partly right: it names some of what was concealed.",
    How.MISSED: "The diagnosis is wrong: it names nothing of what was concealed.",
    How.ABSTAINED: "The diagnosis abstains: it says that it cannot name what was concealed.",
    How.WRONG: "The diagnosis is wrong: it names an effect that was not concealed.",
    How.FALSE_ALARM: "The diagnosis is wrong: it finds missing physics where none was concealed.",
    How.CRASHED: "The diagnosis broke off without an answer.",
}


@dataclass(frozen=True)
class Comparison:
    """Hold how a verdict agrees with the seal.

    names: how the named effects agree with the concealed ones.
    sizes: (effect, or "rig"; parameter) -> true value and estimate with its 95 % interval.
    """

    names: Names
    sizes: Mapping[tuple[str, str], Size]

    @property
    def sentence(self) -> str:
        """Return the conclusion for a person."""
        misses = [f"{owner}.{name}" for (owner, name), s in self.sizes.items() if not s.inside]
        if self.names.how is not How.RIGHT or not misses:
            return SENTENCES[self.names.how]
        subject, verb = ("interval", "misses") if len(misses) == 1 else ("intervals", "miss")
        return f"The names are right, but the {subject} of {', '.join(misses)} {verb} the truth."


def read_verdict(path: str | Path) -> dict[str, Any]:
    """Return the verdict in a file; raise BadInputError when the file holds none."""
    return read_json_object(Path(path), SCHEMA, "a verdict")


def compare_with_seal(
    concealed: Concealed, nominal: Rig, verdict: Mapping[str, Any]
) -> Comparison:
    """Return how the verdict agrees with the seal.

    nominal: the constants from which the diagnosis started.
    """
    sealed = _make_sealed(concealed)
    scale = mass_scale(sealed, nominal)
    sizes = (
        *effect_sizes(sealed, verdict["missing_physics"], scale),
        *rig_sizes(sealed, verdict["rig_parameters"], scale),
    )
    names = judged(sealed, answer_of(verdict))
    return Comparison(names, {(size.owner, size.parameter): size for size in sizes})


def format_comparison(concealed: Concealed, nominal: Rig, verdict: Mapping[str, Any]) -> str:
    """Return the table of the comparison, with its conclusion as the last line.

    Raises BadInputError when the verdict lacks what its schema demands.
    """
    try:
        comparison = compare_with_seal(concealed, nominal, verdict)
        lines = [
            ROW.format("physics", "concealed", "", "found (95 % interval)", "").rstrip(),
            *_list_physics(concealed, verdict["missing_physics"], comparison),
            "",
            ROW.format("rig parameters", "nominal", "true", "found (95 % interval)", "").rstrip(),
            *_list_constants(concealed.rig, nominal, verdict["rig_parameters"], comparison),
            "",
            _format_scores(verdict["fit"]),
            f"Verdict ({verdict['outcome']}): {verdict['sentence']}",
            *[f"Masking: {sentence}." for sentence in verdict.get("masking", [])],
            comparison.sentence,
        ]
    except (KeyError, TypeError, AttributeError) as error:
        raise BadInputError(
            f"verdict: expected what {SCHEMA} holds, found {error!r} missing or odd"
        ) from error
    return "\n".join(lines)


def _make_sealed(concealed: Concealed) -> Sealed:
    """Return the truth as the judge takes it; the judge reads nothing of how it was recorded."""
    unlisted = (UNLISTED[name] for name in concealed.unlisted)
    return Sealed(
        name="demo",
        bag=Path(),
        twin=Path(),
        kind="",
        seed=0,
        pole_counts=0,
        seconds=0.0,
        closed_loop=False,
        size_factor=1.0,
        effects=concealed.effects,
        rig=concealed.rig.to_mapping(),
        unlisted=tuple(Unlisted(law.name, law.place, law.variables) for law in unlisted),
    )


def _list_physics(
    concealed: Concealed, missing_physics: list[Mapping[str, Any]], comparison: Comparison
) -> list[str]:
    """Return the rows of every effect that was concealed or named."""
    entries = {entry["effect"]: entry for entry in missing_physics}
    lines = [] if concealed.effects or entries else ["  none concealed, none found"]
    for name, values in concealed.effects.items():
        lines.append(f"  {name}: {_describe_name(name, entries, comparison.names)}")
        estimates = entries.get(name, {}).get("parameters", {})
        for key, value in values.items():
            size = comparison.sizes.get((name, key))
            lines.append(_format_row(key, f"{value:.4g}", "", estimates.get(key), size))
    for name in [name for name in entries if name not in concealed.effects]:
        lines.append(f"  {name}: was not concealed")
        for key, estimate in entries[name]["parameters"].items():
            lines.append(_format_row(key, "-", "", estimate, None))
    return lines


def _describe_name(name: str, entries: Mapping[str, Mapping[str, Any]], names: Names) -> str:
    """Return whether and how a concealed effect was named."""
    if name in entries:
        inseparable_from = ", ".join(entries[name]["cannot_be_told_from"])
        return "named" + (f" (cannot be told from {inseparable_from})" if inseparable_from else "")
    for cell in names.cells:
        if cell.concealed == name and cell.tied:
            return f"not named, but {cell.named}, which this recording cannot tell from it"
    return "not named"


def _list_constants(
    true: Rig, nominal: Rig, estimates: Mapping[str, Mapping[str, Any]], comparison: Comparison
) -> list[str]:
    """Return the rows of the rig's constants: those that were made wrong or estimated."""
    lines = []
    for key, value in true.to_mapping().items():
        before, estimate = getattr(nominal, key), estimates.get(key)
        if estimate is None and value == before:
            continue
        if estimate is not None:
            estimate = {"unit": UNITS[key], **estimate, "value": estimate["after"]}
        size = comparison.sizes.get((RIG, key))
        lines.append(_format_row(key, f"{before:.4g}", f"{value:.4g}", estimate, size))
    return lines


def _format_row(
    key: str, first: str, second: str, estimate: Mapping[str, Any] | None, size: Size | None
) -> str:
    """Return the row of a parameter.

    first, second: the true value, or the nominal and the true value.
    estimate: value with interval and unit; None when the verdict has none.
    size: the estimate as it was judged; None when the parameter is not judged.
    """
    if estimate is None:
        return ROW.format("  " + key, first, second, "-", "").rstrip()
    interval = f"[{estimate['low']:.4g}, {estimate['high']:.4g}]"
    shown = f"{estimate['value']:.4g} {interval} {estimate['unit']}"
    identifiable = estimate.get("identifiable", True)
    judged_text = _format_error(size) if identifiable else "not identifiable"
    return ROW.format("  " + key, first, second, shown, judged_text).rstrip()


def _format_error(size: Size | None) -> str:
    """Return `right` when the interval holds the truth, else how far the estimate is off."""
    if size is None:
        return ""
    if size.inside:
        return "right"
    if size.true:
        return f"off by {100 * (size.value / size.true - 1):+.2g} %"
    return f"off by {size.value:+.2g}"


def _format_scores(fit: Mapping[str, Any]) -> str:
    held_out = fit["held_out"]
    return (
        f"Misfit in stretches that no fit has seen: {held_out['before']:.4g} before, "
        f"{held_out['after']:.4g} after ({fit['unit']}; noise floor {fit['noise_floor']:.4g})"
    )
