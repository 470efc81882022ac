"""The proof as one page for people: a self-contained HTML file that looks like the reports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pendulum_sysid.studies.proof.dose_response import Response
from pendulum_sysid.studies.proof.page_tables import (
    STRIP_ERROR,
    draw_held_out,
    list_confusion_rows,
    list_dose_cells,
    list_factors,
    list_held_out_rows,
    list_modelled_rows,
    list_size_rows,
    list_time_rows,
    list_trial_rows,
)
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof_text import ANSWERS, format_count
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.rival_models.registry import RIVAL_MODELS
from pendulum_sysid.studies.proof.rival_models.table import (
    compare_predictors,
    list_errors,
    list_models,
    list_unlisted,
)
from pendulum_sysid.studies.proof.rivals import RIVALS
from pendulum_sysid.studies.proof.statistics import (
    ORACLE_FACTOR,
    collect_rig_constants,
    collect_sizes,
    compare_methods,
    count_confusion,
    count_depends,
    count_located,
)
from pendulum_sysid.studies.proof.targets import Target, check_targets, format_share
from pendulum_sysid.telling import display

TEMPLATE = "proof.html.j2"
TEMPLATES = [Path(file).parent / "templates" for file in (__file__, display.__file__)]
FILTERS = {
    "number": display.render_number,
    "quantity": display.format_quantity,
    "count": display.format_count,
    "percent": display.format_percent,
}


def render_page(
    plan: Plan, judgements: Sequence[Judgement], responses: Sequence[Response], elapsed_s: float
) -> str:
    """Return the proof as HTML; every section may be empty, and the page then says so."""
    matrix = count_confusion(judgements)
    targets = check_targets(judgements)
    factors = list_factors(responses)
    first = judgements[0].trial if judgements else None
    return (
        _make_environment()
        .get_template(TEMPLATE)
        .render(
            plan=plan,
            trials_count=len(judgements),
            recording_s=plan.seconds or (first and first.seconds),
            pole_counts=plan.pole_counts or (first and first.pole_counts),
            elapsed_s=elapsed_s,
            targets=targets,
            sentence=summarise_targets(targets, len(judgements)),
            answers=ANSWERS,
            methods=compare_methods(judgements),
            rivals={rival.name: rival.sentence for rival in RIVALS},
            matrix=matrix,
            matrix_rows=list_confusion_rows(matrix),
            sizes=list_size_rows(collect_sizes(judgements)),
            shapes=list_size_rows(collect_sizes(judgements, shape=True)),
            rig=list_size_rows(collect_rig_constants(judgements)),
            strip_error=STRIP_ERROR,
            held_out=list_held_out_rows(judgements),
            held_out_picture=draw_held_out(judgements),
            oracle_factor=ORACLE_FACTOR,
            located=count_located(judgements),
            depends=count_depends(judgements),
            models=list_models(list_unlisted(judgements)),
            modelled=list_modelled_rows(judgements),
            predictors=compare_predictors(judgements),
            model_sentences={rival.name: rival.sentence for rival in RIVAL_MODELS},
            model_errors=list_errors(judgements),
            times=list_time_rows(judgements),
            factors=factors,
            doses=[(response, list_dose_cells(response, factors)) for response in responses],
            trials=list_trial_rows(judgements),
            command=format_command(plan),
        )
    )


def summarise_targets(targets: Sequence[Target], trials: int) -> str:
    """Return what the proof comes to, in one sentence."""
    tried = [target for target in targets if target.met is not None]
    missed = [target.what for target in tried if not target.met]
    recordings = f"{trials} {'recording' if trials == 1 else 'recordings'}"
    beginning = f"{recordings} of rigs with concealed physics:"
    if not tried:
        return f"{beginning} none could be judged."
    if not missed:
        return f"{beginning} all {len(tried)} targets that were tried are met."
    met = f"{len(tried) - len(missed)} of {len(tried)} targets are met"
    return f"{beginning} {met}; not met: {'; '.join(missed)}."


def format_command(plan: Plan) -> str:
    """Return the command that gives this proof again."""
    options = {
        "--pole-counts": plan.pole_counts,
        "--seconds": plan.seconds,
        "--kinds": plan.kinds,
        "--twin": plan.twin,
        "--dose-response": plan.dose_tries or None,
    }
    flags = {
        "--closed-loop": plan.closed_loop,
        "--relay": plan.relay,
        "--pairs": plan.pairs,
        "--rest": plan.rest,
        "--rivals": bool(plan.rivals),
    }
    return " ".join(
        [
            f"sysid prove --trials {plan.trials} --seed {plan.seed}",
            *(f"{name} {value}" for name, value in options.items() if value is not None),
            *(name for name, wanted in flags.items() if wanted),
            "--out DIR",
        ]
    )


def _make_environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(FILTERS)
    environment.globals.update(format_share=format_share, format_count=format_count)
    return environment
