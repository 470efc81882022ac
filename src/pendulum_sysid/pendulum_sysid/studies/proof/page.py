"""The proof as one page for people: a self-contained HTML file in the look of the reports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jinja2 import ChainableUndefined, Environment, FileSystemLoader

from pendulum_sysid.studies.proof import page_tables as page_rows
from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.dose_response import Response
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof_text import ANSWERS, format_count
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.rivals import RIVALS
from pendulum_sysid.studies.proof.targets import Target, check_targets, format_share
from pendulum_sysid.telling import display

TEMPLATE = "proof.html.j2"
FILTERS = (display.number, display.quantity, display.count, display.percent, display.with_unit)


def render_page(
    plan: Plan, judged: Sequence[Judgement], responses: Sequence[Response], elapsed_s: float
) -> str:
    """Return the proof as HTML; every part may be empty, and the page then says so."""
    matrix = statistics.count_confusion(judged)
    rows = check_targets(judged)
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(
            plan=plan,
            judged=judged,
            elapsed_s=elapsed_s,
            marks=rows,
            sentence=summarise_targets(rows, len(judged)),
            met_words=ANSWERS,
            methods=statistics.compare_methods(judged),
            rivals={one.name: one.sentence for one in RIVALS},
            matrix=matrix,
            matrix_rows=page_rows.list_confusion_rows(matrix),
            sizes=page_rows.list_size_rows(statistics.collect_sizes(judged)),
            shapes=page_rows.list_size_rows(statistics.collect_sizes(judged, shape=True)),
            rig=page_rows.list_size_rows(statistics.collect_rig_constants(judged)),
            shown_error=page_rows.SHOWN_ERROR,
            held_out=_held_out_rows(judged),
            held_out_picture=page_rows.draw_held_out(judged),
            within=statistics.WITHIN,
            located=statistics.count_located(judged),
            depends=statistics.count_depends(judged),
            seconds=_seconds_rows(judged),
            factors=page_rows.list_factors(responses),
            doses=[(one, page_rows.list_dose_cells(one, responses)) for one in responses],
            trials=page_rows.list_trial_rows(judged),
            command=format_command(plan),
        )
    )


def summarise_targets(rows: Sequence[Target], trials: int) -> str:
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


def format_command(plan: Plan) -> str:
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
        ("the nominal twin, before", statistics.compute_quantiles(one.before for one in scores)),
        ("after diagnosis", statistics.compute_quantiles(one.after for one in scores)),
        (
            "a fit that was told the truth",
            statistics.compute_quantiles(one.told for one in scores),
        ),
        (
            "what a perfect model would reach",
            statistics.compute_quantiles(one.floor for one in scores),
        ),
        (
            "after diagnosis / told the truth",
            statistics.compute_quantiles(statistics.list_ratios(judged)),
        ),
    ]


def _seconds_rows(
    judged: Sequence[Judgement],
) -> list[tuple[str, statistics.Quantiles, statistics.Quantiles]]:
    """Return kind, seconds by the clock, and seconds of the thread; all kinds first."""
    kinds = ["", *dict.fromkeys(one.sealed.kind for one in judged)] if judged else []
    return [
        (
            kind or "all",
            statistics.scale_seconds(judged, kind),
            statistics.scale_seconds(judged, kind, cpu=True),
        )
        for kind in kinds
    ]


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(
            [Path(__file__).parent / "templates", Path(display.__file__).parent / "templates"]
        ),
        autoescape=True,
        undefined=ChainableUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update({one.__name__: one for one in FILTERS})
    environment.globals.update(counted=format_share, of=format_count)
    return environment
