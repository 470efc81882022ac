"""Write a verdict as one self-contained HTML page; the same verdict gives the same bytes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from pendulum_sysid.records import Evidence, Outcome, Overlay, Trial
from pendulum_sysid.telling import display, svg, wording
from pendulum_sysid.telling.error_scale import draw_meaning, get_floors, list_marks
from pendulum_sysid.telling.evidence_rows import describe_residuals, round_correlations
from pendulum_sysid.telling.light import judge_light
from pendulum_sysid.telling.motion_figure import draw_motion
from pendulum_sysid.telling.plot_specs import specify_residuals, specify_shape
from pendulum_sysid.telling.report_data import make_data
from pendulum_sysid.telling.shape_figure import draw_shape
from pendulum_sysid.telling.steps import list_steps
from pendulum_sysid.telling.visited import describe_visited
from pendulum_sysid.telling.whiskers import list_whiskers
from pendulum_sysid.telling.window_figures import draw_errors, draw_windows
from pendulum_sysid.telling.window_list import find_worst, list_largest, list_windows
from pendulum_sysid.verdict.record import Interval, MeasuredLaw, Verdict
from pendulum_sysid.verdict.scores import FitScores
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.files import write_atomically
from pendulum_twin.laws import BY_NAME as LAW_KINDS

Json = dict[str, Any]

TEMPLATE = "report.html.j2"
FIRST_TRIALS = 12  # rows of the table of trials that are open; the others fold away
FILTERS = {  # name in the template -> function
    "number": display.render_number,
    "quantity": display.format_quantity,
    "count": display.format_count,
    "percent": display.format_percent,
    "confidence": display.format_confidence,
    "change": display.format_change,
    "times_better": display.describe_improvement,
    "spans": display.format_intervals,
    "with_unit": display.add_unit,
    "format_sentence": display.format_sentence,
    "seconds": display.format_seconds,
}


@dataclass(frozen=True)
class TrialRow:
    """Hold one row of the table of trials.

    turn: place in the order of the search, from 1.
    bar: length of the row's bar, 0 to 1, the misfit on a logarithmic scale.
    chosen: True for the set of effects that the improved twin has.
    """

    turn: int
    trial: Trial
    bar: float
    chosen: bool


@dataclass(frozen=True)
class EvidenceRow:
    """Hold one piece of evidence with its picture, empty for a single number, and its plot."""

    variable: str
    finding: str
    share: float
    picture: Markup
    plot: Json | None


@dataclass(frozen=True)
class LawRow:
    """Hold a measured law with its picture, and the same for the script."""

    law: MeasuredLaw
    picture: Markup
    plot: Json | None


@dataclass(frozen=True)
class Channel:
    """Hold the pictures of one channel: some windows in detail, and the error of every window."""

    name: str
    unit: str
    panels: tuple[Markup, ...]
    errors: Markup
    windows: int


@dataclass(frozen=True)
class FitRow:
    """Hold an error, or a fit, before and after on one group of windows.

    unit: empty for an error in noise floors.
    falls: True for an error, which is to fall; False for a fit, which is to rise.
    """

    words: str
    unit: str
    before: float
    after: float
    falls: bool = True


def write_report(verdict: Verdict, path: str | Path) -> None:
    """Write the page of a verdict, whole or not at all."""
    write_atomically(path, render_page(verdict))


def render_page(verdict: Verdict) -> str:
    """Return the page of a verdict as HTML."""
    template = _make_environment().get_template(TEMPLATE)
    windows = list_windows(verdict)
    light, evidence, laws = (
        judge_light(verdict),
        list_evidence_rows(verdict),
        list_law_rows(verdict),
    )
    drawings = verdict.drawings
    residuals = drawings.residuals if drawings is not None else ()
    specs = [spec for test in residuals for spec in specify_residuals(test)]
    shapes = [*(row.plot for row in evidence), *(row.plot for row in laws)]
    specs += [spec for spec in shapes if spec is not None]
    return template.render(
        verdict=verdict,
        light=light,
        steps=list_steps(verdict, light, find_worst(windows)),
        origin=verdict.origin,
        windows=windows,
        listed=list_largest(windows),
        motion_picture=Markup(draw_motion(drawings.motion, windows)) if drawings else "",
        left_out=len(drawings.motion.left_out_s) if drawings else 0,
        breaks=len(drawings.motion.breaks_s) if drawings else 0,
        visited=describe_visited(verdict.recording.visited),
        residuals=[describe_residuals(test) for test in residuals],
        whiskers=list_whiskers(verdict),
        correlations=round_correlations(verdict),
        floors=get_floors(verdict.fit) if verdict.fit is not None else None,
        marks=list_marks(verdict),
        meanings=draw_meaning(verdict),
        data=Markup(make_data(verdict, windows, specs)),
        outcome=choose_words(verdict),
        catalogue=BY_NAME,
        wording=wording,
        channels=_draw_channels(verdict),
        fit_rows=list_fit_rows(verdict.fit),
        evidence=evidence,
        named_places=describe_places(verdict),
        laws=laws,
        trials=list_trial_rows(verdict),
        first_trials=FIRST_TRIALS,
    )


@cache
def _make_environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(FILTERS)
    environment.filters["capitalize"] = _capitalise
    environment.globals.update(estimate=display.format_estimate, legend=_draw_legend())
    return environment


def _capitalise(text: str) -> str:
    """Return the text with its first letter large; the others stay as they are."""
    return text[:1].upper() + text[1:]


def list_trial_rows(verdict: Verdict) -> list[TrialRow]:
    """Return the trials, the best on windows left out first.

    The best trial with the effects of the improved twin is marked as chosen.
    """
    misfits = [t.choose for t in verdict.trials if math.isfinite(t.choose) and t.choose > 0]
    low, high = min([1.0, *misfits]), max([1.0, *misfits])
    ranked = sorted(
        enumerate(verdict.trials, start=1), key=lambda pair: (_get_misfit(pair[1]), pair[0])
    )
    effects = frozenset(verdict.twin.effects) if verdict.twin is not None else None
    chosen = next((turn for turn, t in ranked if frozenset(t.effects) == effects), None)
    return [
        TrialRow(turn, t, _scale_bar(_get_misfit(t), low, high), turn == chosen)
        for turn, t in ranked
    ]


def _get_misfit(trial: Trial) -> float:
    return trial.choose if math.isfinite(trial.choose) else math.inf


def _scale_bar(misfit: float, low: float, high: float) -> float:
    if misfit <= low:
        return 0.0
    return 1.0 if misfit >= high else math.log(misfit / low) / math.log(high / low)


def list_fit_rows(fit: FitScores | None) -> list[FitRow]:
    """Return errors before and after in noise floors, then in units of their own, then fits."""
    if fit is None:
        return []
    rows = []
    for name, (words, unit) in wording.FIT_ROWS.items():
        errors = getattr(fit, name)
        if errors is None:
            continue
        size = 1.0 if unit or name == "floors" else fit.noise_floor or 1.0
        rows.append(FitRow(words, unit, errors.before / size, errors.after / size, unit != "%"))
    return rows


def list_evidence_rows(verdict: Verdict) -> list[EvidenceRow]:
    """Return the evidence of the localisation with a picture of every measured shape."""
    if verdict.localisation is None:
        return []
    place = verdict.localisation.place
    return [_draw_evidence(e, place, k) for k, e in enumerate(verdict.localisation.evidence)]


def describe_places(verdict: Verdict) -> str:
    """Return, after a blank, where the named effects act; nothing where that is one place."""
    if verdict.outcome is Outcome.NOT_IN_CATALOGUE:
        return ""
    names = [missing.effect for missing in verdict.missing_physics]
    acting = {BY_NAME[name].place for name in names if name in BY_NAME}
    places = [place.value for place in Place if place in acting]
    if len(places) < 2:
        return ""
    listed = f"{', '.join(places[:-1])} and {places[-1]}"
    return f" The named effects act at {listed}; this is the place of the clearest of them."


def choose_words(verdict: Verdict) -> wording.OutcomeWords:
    """Return the words for what a verdict says."""
    if verdict.events_s:
        return wording.EVENTS
    return wording.CHANGED if verdict.rig_changed else wording.OUTCOMES[verdict.outcome]


def list_law_rows(verdict: Verdict) -> list[LawRow]:
    """Return the measured laws, each with a picture of its curve and band."""
    return [_draw_law(law, k) for k, law in enumerate(verdict.measured_laws)]


def _draw_law(law: MeasuredLaw, k: int) -> LawRow:
    kind = LAW_KINDS[law.law]
    values, high = np.array(law.values), np.array(law.high)
    shown = Evidence(law.law, "", 0.0, np.array(law.knots), values, high - values)
    along = _label_axis(kind.along.words, kind.along.unit)
    labels = along, _label_axis(kind.quantity.words, law.unit)
    picture = draw_shape(shown, f"law-{k}", *labels)
    return LawRow(law, Markup(picture), specify_shape(shown, f"law-{k}", *labels))


def _draw_evidence(evidence: Evidence, place: str, k: int) -> EvidenceRow:
    name, unit = wording.name_variable(evidence.variable)
    along = wording.name_variable(evidence.shape_axis) if evidence.shape_axis else (name, unit)
    shown = (
        _label_axis(evidence.shape_of, evidence.shape_unit)
        if evidence.shape_of
        else wording.name_unexplained(place)
    )
    labels = _label_axis(*along), shown
    picture = draw_shape(evidence, f"shape-{k}", *labels)
    spec = specify_shape(evidence, f"shape-{k}", *labels)
    return EvidenceRow(name, evidence.finding, evidence.share, Markup(picture), spec)


def _label_axis(name: str, unit: str) -> str:
    return f"{name} ({display.format_unit(unit)})" if display.format_unit(unit) else name


def _draw_channels(verdict: Verdict) -> list[Channel]:
    intervals_s = verdict.location.intervals_s if verdict.location is not None else ()
    return [_draw_channel(o, intervals_s) for o in verdict.overlays if len(o.times_s)]


def _draw_channel(overlay: Overlay, intervals_s: Sequence[Interval]) -> Channel:
    panels = tuple(Markup(panel) for panel in draw_windows(overlay))
    errors = Markup(draw_errors(overlay, intervals_s))
    return Channel(overlay.channel, overlay.unit, panels, errors, len(overlay.times_s))


def _draw_legend() -> list[tuple[str, Markup]]:
    """Return the names of the lines, each with a sample as the pictures draw it."""
    lines = (
        ("measured", f'stroke="{svg.PALE}" stroke-width="5" stroke-linecap="round"'),
        (
            "before: the twin as given",
            f'stroke="{svg.INK}" stroke-width="1.6" stroke-dasharray="5 3"',
        ),
        ("after: the improved twin", f'stroke="{svg.ACCENT}" stroke-width="2.2"'),
    )
    sample = (
        '<svg viewBox="0 0 34 10" width="34" height="10" aria-hidden="true">'
        '<path d="M3 5H31" fill="none" {}/></svg>'
    )
    return [(name, Markup(sample.format(look))) for name, look in lines]
