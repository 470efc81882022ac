"""The proof as one page for people: a self-contained HTML file in the look of the reports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jinja2 import ChainableUndefined, Environment, FileSystemLoader

from pendulum_sysid.studies.proof import page_rows, statistics
from pendulum_sysid.studies.proof.dose import Response
from pendulum_sysid.studies.proof.marks import Mark, counted, marks
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.printed import ANSWERS, of
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.rivals import RIVALS
from pendulum_sysid.telling import display

TEMPLATE = "proof.html.j2"
FILTERS = (display.number, display.quantity, display.count, display.percent, display.with_unit)


def page(
    plan: Plan, judged: Sequence[Judgement], responses: Sequence[Response], elapsed_s: float
) -> str:
    """Return the proof as HTML; every part may be empty, and the page then says so."""
    matrix = statistics.confusion(judged)
    rows = marks(judged)
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(
            plan=plan,
            judged=judged,
            elapsed_s=elapsed_s,
            marks=rows,
            sentence=sentence(rows, len(judged)),
            met_words=ANSWERS,
            methods=statistics.methods(judged),
            rivals={one.name: one.sentence for one in RIVALS},
            matrix=matrix,
            matrix_rows=page_rows.confusion_rows(matrix),
            sizes=page_rows.size_rows(statistics.named_sizes(judged)),
            shapes=page_rows.size_rows(statistics.named_sizes(judged, shape=True)),
            rig=page_rows.size_rows(statistics.rig_sizes(judged)),
            shown_error=page_rows.SHOWN_ERROR,
            held_out=_held_out_rows(judged),
            held_out_picture=page_rows.held_out_picture(judged),
            within=statistics.WITHIN,
            located=statistics.located(judged),
            depends=statistics.depends(judged),
            seconds=_seconds_rows(judged),
            factors=page_rows.factors(responses),
            doses=[(one, page_rows.dose_cells(one, responses)) for one in responses],
            trials=page_rows.trial_rows(judged),
            command=command(plan),
        )
    )


def sentence(rows: Sequence[Mark], trials: int) -> str:
    """Return what the proof comes to, in one sentence."""
    asked = [one for one in rows if one.met is not None]
    missed = [one.what for one in asked if not one.met]
    beginning = (
        f"{trials} {'recording' if trials == 1 else 'recordings'} of rigs with concealed physics:"
    )
    if not asked:
        return f"{beginning} none could be judged."
    if not missed:
        return f"{beginning} all {len(asked)} marks that they can speak to are met."
    return f"{beginning} {len(asked) - len(missed)} of {len(asked)} marks are met, not met: {'; '.join(missed)}."


def command(plan: Plan) -> str:
    """Return the command that gives this proof again."""
    options = {
        "--pole-counts": plan.pole_counts,
        "--seconds": plan.seconds,
        "--kinds": plan.kinds,
        "--twin": plan.twin,
        "--dose-response": plan.dose_tries or None,
    }
    given = [f"{name} {value}" for name, value in options.items() if value is not None]
    flags = [
        name
        for name, on in (("--closed-loop", plan.closed_loop), ("--rivals", bool(plan.rivals)))
        if on
    ]
    return " ".join(
        [f"sysid prove --trials {plan.trials} --seed {plan.seed}", *given, *flags, "--out DIR"]
    )


def _held_out_rows(judged: Sequence[Judgement]) -> list[tuple[str, statistics.Quantiles]]:
    scores = [one.held_out for one in judged if not one.sealed.unlisted]
    return [
        ("the nominal twin, before", statistics.quantiles(one.before for one in scores)),
        ("after diagnosis", statistics.quantiles(one.after for one in scores)),
        ("a fit that was told the truth", statistics.quantiles(one.told for one in scores)),
        ("what a perfect model would reach", statistics.quantiles(one.floor for one in scores)),
        ("after diagnosis / told the truth", statistics.quantiles(statistics.ratios(judged))),
    ]


def _seconds_rows(
    judged: Sequence[Judgement],
) -> list[tuple[str, statistics.Quantiles, statistics.Quantiles]]:
    """Return kind, seconds by the clock, and seconds of the thread; all kinds first."""
    kinds = ["", *dict.fromkeys(one.sealed.kind for one in judged)] if judged else []
    return [
        (
            kind or "all",
            statistics.scaled_seconds(judged, kind),
            statistics.scaled_seconds(judged, kind, cpu=True),
        )
        for kind in kinds
    ]


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parents[2] / "telling" / "templates"),
        autoescape=True,
        undefined=ChainableUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update({one.__name__: one for one in FILTERS})
    environment.globals.update(counted=counted, of=of)
    return environment
