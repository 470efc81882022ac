"""Write a diagnosis as one page for people: a self-contained HTML file, the same bytes for the same diagnosis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import ChainableUndefined, Environment, FileSystemLoader
from markupsafe import Markup

from pendulum_sysid.records import Diagnosis, Evidence, Outcome, Overlay, Trial
from pendulum_sysid.telling import display, figures, wording
from pendulum_sysid.telling.display import mapping
from pendulum_twin.effects import BY_NAME
from pendulum_twin.files import write_atomically

TEMPLATE = "report.html.j2"
FIRST_TRIALS = 12  # shown at once; the others fold away
FILTERS = (
    display.number, display.quantity, display.count, display.percent, display.confidence, display.change,
    display.times_better, display.spans, display.unit, display.with_unit,
)  # fmt: skip


@dataclass(frozen=True)
class TrialRow:
    """Hold one hypothesis as the table shows it: its turn, and the length of its bar, 0 to 1 on a logarithmic scale."""

    turn: int
    trial: Trial
    bar: float
    chosen: bool


@dataclass(frozen=True)
class EvidenceRow:
    """Hold one piece of evidence with its picture, empty where nothing was measured that can be drawn."""

    variable: str
    finding: Any
    share: Any
    picture: Markup


@dataclass(frozen=True)
class Channel:
    """Hold the pictures of one channel: a few windows from close by, and the errors of all."""

    name: str
    panels: tuple[Markup, ...]
    errors: Markup
    windows: int


@dataclass(frozen=True)
class FitRow:
    """Hold an error before and after on one set of windows; unit is empty for a score."""

    words: str
    unit: str
    before: Any
    after: Any


def write_report(diagnosis: Diagnosis, path: str | Path) -> None:
    """Write the diagnosis as one HTML file, whole or not at all.

    The verdict may lack any of its keys, and every part of the diagnosis may be empty: the page
    then says so. Beyond the contract it also shows `recording.name`, `command` (how to repeat the
    diagnosis) and, in `fit`, errors in their own units such as `held_out_cart_mm: {before,
    after}`.
    """
    write_atomically(path, page(diagnosis))


def page(diagnosis: Diagnosis) -> str:
    """Return the report as HTML."""
    verdict = mapping(diagnosis.verdict)
    template = _environment().get_template(TEMPLATE)
    return template.render(
        verdict=verdict,
        twin=diagnosis.twin,
        outcome=_outcome_words(verdict),
        catalogue=BY_NAME,
        wording=wording,
        channels=_channels(diagnosis),
        fit_rows=fit_rows(mapping(verdict.get("fit"))),
        evidence=evidence_rows(diagnosis),
        trials=trial_rows(diagnosis.trials, named_effects(diagnosis)),
        first_trials=FIRST_TRIALS,
    )


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=ChainableUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update({one.__name__: one for one in FILTERS})
    environment.globals.update(estimate=display.estimate, mapping=mapping, legend=_legend())
    return environment


def _outcome_words(verdict: Any) -> wording.OutcomeWords:
    try:
        return wording.OUTCOMES[Outcome(verdict.get("outcome"))]
    except ValueError:
        return wording.UNKNOWN


def named_effects(diagnosis: Diagnosis) -> frozenset[str]:
    """Return the effects of the improved twin, or, without one, those that the verdict names."""
    if diagnosis.twin is not None:
        return frozenset(diagnosis.twin.effects)
    return frozenset(
        str(one.get("effect")) for one in mapping(diagnosis.verdict).get("missing_physics") or ()
    )


def trial_rows(trials: Sequence[Trial], chosen: frozenset[str]) -> list[TrialRow]:
    """Return the hypotheses, the best on the choosing windows first; the best with the chosen effects is marked."""
    finite = [t.choose for t in trials if math.isfinite(t.choose) and t.choose > 0]
    low, high = (min(1.0, *finite), max(1.0, *finite)) if finite else (1.0, 1.0)
    ranked = sorted(enumerate(trials, start=1), key=lambda one: (_misfit(one[1]), one[0]))
    best = next((turn for turn, t in ranked if frozenset(t.effects) == chosen), None)
    return [TrialRow(turn, t, _bar(_misfit(t), low, high), turn == best) for turn, t in ranked]


def _misfit(trial: Trial) -> float:
    return trial.choose if math.isfinite(trial.choose) else math.inf


def _bar(misfit: float, low: float, high: float) -> float:
    if misfit <= low:
        return 0.0
    return 1.0 if misfit >= high else math.log(misfit / low) / math.log(high / low)


def fit_rows(fit: Any) -> list[FitRow]:
    """Return the verdict's errors before and after: scores first, then what the fit holds in units of its own."""
    known = [key for key in wording.FIT_ROWS if key in fit]
    others = [key for key in fit if key not in wording.FIT_ROWS and mapping(fit[key])]
    rows = []
    for key in known + others:
        words, unit = wording.FIT_ROWS.get(key, (str(key).replace("_", " "), ""))
        pair = mapping(fit[key]) or {"after": fit[key]}
        rows.append(FitRow(words, unit, pair.get("before"), pair.get("after")))
    return rows


def evidence_rows(diagnosis: Diagnosis) -> list[EvidenceRow]:
    """Return the evidence with pictures, from the localisation or, without one, from the verdict's words alone."""
    place = diagnosis.localisation
    if place is not None:
        return [_evidence_row(one, place.place, k) for k, one in enumerate(place.evidence)]
    told = mapping(mapping(diagnosis.verdict).get("location")).get("evidence") or ()
    return [
        EvidenceRow(
            _variable(one.get("variable"))[0], one.get("finding"), one.get("share"), Markup()
        )
        for one in told
    ]


def _evidence_row(one: Evidence, place: str, k: int) -> EvidenceRow:
    name, unit = _variable(one.variable)
    along = _axis(*_variable(one.shape_axis)) if one.shape_axis else _axis(name, unit)
    shown = _axis(one.shape_of, one.shape_unit) if one.shape_of else _unexplained(place)
    drawn = figures.shape_panel(one, f"shape-{k}", along, shown)
    return EvidenceRow(name, one.finding, one.share, Markup(drawn))


def _variable(name: Any) -> tuple[str, str]:
    """Return a variable's words and unit; a product's, without a unit, are those of its factors."""
    factors = [
        wording.VARIABLES.get(part, (part.replace("_", " "), "")) for part in str(name).split("*")
    ]
    return " × ".join(words for words, _ in factors), factors[0][1] if len(factors) == 1 else ""


def _unexplained(place: str) -> str:
    if place in wording.FORCE_PLACES:
        return "unexplained force (N)"
    return "unexplained torque (N·m)" if place == "pole" else "unexplained"


def _axis(name: str, unit: str) -> str:
    return f"{name} ({display.unit(unit)})" if display.unit(unit) else name


def _channels(diagnosis: Diagnosis) -> list[Channel]:
    place = mapping(mapping(diagnosis.verdict).get("location"))
    drawn = [_channel(one, place.get("intervals_s") or ()) for one in diagnosis.overlays]
    return [one for one in drawn if one.panels]


def _channel(overlay: Overlay, intervals_s: Sequence[Sequence[float]]) -> Channel:
    panels = tuple(Markup(one) for one in figures.overlay_panels(overlay))
    errors = Markup(figures.error_panel(overlay, intervals_s))
    return Channel(overlay.channel, panels, errors, len(overlay.times_s))


def _legend() -> list[tuple[str, Markup]]:
    """Return the names of the lines, each with a sample as the pictures draw it."""
    drawn = (
        ("measured", f'stroke="{figures.PALE}" stroke-width="5" stroke-linecap="round"'),
        (
            "before: the twin as given",
            f'stroke="{figures.INK}" stroke-width="1.6" stroke-dasharray="5 3"',
        ),
        ("after: the improved twin", f'stroke="{figures.ACCENT}" stroke-width="2.2"'),
    )
    sample = '<svg viewBox="0 0 34 10" width="34" height="10" aria-hidden="true"><path d="M3 5H31" fill="none" {}/></svg>'
    return [(name, Markup(sample.format(look))) for name, look in drawn]
