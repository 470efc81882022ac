"""The seal beside the verdict: what was concealed and what the diagnosis found, as a table.

The judge is the proof's own (`pendulum_sysid.studies.proof`); this module prints what it decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted.table import BY_NAME as UNLISTED
from pendulum_sysid.studies.proof.answers import read_answer
from pendulum_sysid.studies.proof.names import judge_names
from pendulum_sysid.studies.proof.records import (
    NamesJudgement,
    NamesOutcome,
    Seal,
    Size,
    UnlistedEffect,
)
from pendulum_sysid.studies.proof.sizes import (
    RIG,
    compare_effect_sizes,
    compare_rig_constants,
    compute_mass_scale,
    describe_deviation,
)
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object
from pendulum_twin.rig import UNITS, Rig
from pendulum_twin.schemas import VERDICT

# answers of which a person may take the sizes for right as well
PARTLY_RIGHT = (NamesOutcome.RIGHT, NamesOutcome.TIED, NamesOutcome.INCOMPLETE)
ROW = "  {:<26} {:>10} {:>10}   {:<46} {}"


@dataclass(frozen=True)
class Comparison:
    """Hold how a verdict agrees with the seal.

    names: how the named effects agree with the concealed ones.
    sizes: (effect, or "rig"; parameter) -> true value and estimate with its 95 % interval.
    """

    names: NamesJudgement
    sizes: Mapping[tuple[str, str], Size]

    @property
    def sentence(self) -> str:
        """Return the conclusion for a person."""
        misses = [f"{owner}.{name}" for (owner, name), s in self.sizes.items() if not s.inside]
        if not misses or self.names.outcome not in PARTLY_RIGHT:
            return self.names.outcome.sentence
        subject, verb = ("interval", "misses") if len(misses) == 1 else ("intervals", "miss")
        miss = f"the {subject} of {', '.join(misses)} {verb} the truth"
        if self.names.outcome is NamesOutcome.RIGHT:
            return f"The names are right, but {miss}."
        return f"{self.names.outcome.sentence} And {miss}."


def read_verdict(path: str | Path) -> dict[str, Any]:
    """Return the verdict in a file; raise BadInputError when the file holds none."""
    return read_json_object(Path(path), VERDICT, "a verdict")


def compare_with_seal(
    concealed: Concealed, nominal: Rig, verdict: Mapping[str, Any]
) -> Comparison:
    """Return how the verdict agrees with the seal.

    nominal: the constants from which the diagnosis started.
    """
    seal = _make_seal(concealed)
    scale = compute_mass_scale(seal, nominal)
    sizes = (
        *compare_effect_sizes(seal, verdict["missing_physics"], scale),
        *compare_rig_constants(seal, verdict["rig_parameters"], scale),
    )
    names = judge_names(seal, read_answer(verdict))
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
            f"verdict: expected what {VERDICT} holds, found {error!r} missing or odd"
        ) from error
    return "\n".join(lines)


def _make_seal(concealed: Concealed) -> Seal:
    """Return the truth as the judge takes it."""
    laws = (UNLISTED[name] for name in concealed.unlisted)
    return Seal(
        effects=concealed.effects,
        rig=concealed.rig.to_mapping(),
        unlisted=tuple(UnlistedEffect(law.name, law.place, law.variables) for law in laws),
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


def _describe_name(
    name: str, entries: Mapping[str, Mapping[str, Any]], names: NamesJudgement
) -> str:
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
    deviation = "" if size is None else describe_deviation(size)
    judged_text = deviation if identifiable else "not identifiable"
    return ROW.format("  " + key, first, second, shown, judged_text).rstrip()


def _format_scores(fit: Mapping[str, Any]) -> str:
    held_out = fit["held_out"]
    before, after, floor = (
        "beyond measure" if score is None else f"{score:.4g}"
        for score in (held_out["before"], held_out["after"], fit["noise_floor"])
    )
    return (
        f"Misfit in stretches that no fit has seen: {before} before, {after} after "
        f"({fit['unit']}; noise floor {floor})"
    )
