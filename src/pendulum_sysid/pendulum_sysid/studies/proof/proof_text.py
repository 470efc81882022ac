"""The proof as lines of text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid.studies.proof.dose_response import Response
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.rival_models.table import (
    Predictor,
    compare_predictors,
    list_errors,
    list_models,
    list_unlisted,
)
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.statistics import (
    LISTED_KINDS,
    Method,
    compare_methods,
    count_modelled,
)
from pendulum_sysid.studies.proof.targets import check_targets, format_share
from pendulum_sysid.telling.tables import NOTHING, Row, format_number, format_table

ANSWERS = {True: "yes", False: "no", None: NOTHING}
TARGETS: Row = ("what", "result", "95 % interval or others", "target", "met")
METHODS: Row = (
    "method",
    "single",
    "pair",
    "triple",
    "quadruple",
    "false alarms",
    "unlisted misnamed",
    "wrong in all",
    "abstained",
    "s",
)
MODELLED: Row = ("unlisted physics", "place", "place told", "named", "floors elsewhere")
RANDOM = "(random)"
PREDICTORS: Row = (
    "prediction elsewhere",
    "within 1.5 floors",
    "within 3",
    "floors, median",
    "90 % below",
    "CPU s",
)
DOSES: Row = ("effect", "smallest size found", "in half widths", "tries there", "tried down to")


def format_proof(judgements: Sequence[Judgement], responses: Sequence[Response]) -> str:
    """Return the targets, the methods when there are rivals, and the doses when there are any."""
    blocks = [format_table(TARGETS, list_target_rows(judgements))]
    unlisted = list_unlisted(judgements)
    if unlisted:
        models = list_models(unlisted)
        rows = [format_modelled(judgement, models) for judgement in unlisted]
        blocks.append(format_table((*MODELLED, *models), rows))
        shares = [count_modelled(judgements, most) for most in (1.5, 3.0)]
        blocks.append(
            f"modelled within 1.5 floors: {format_count(shares[0])}; within 3: "
            f"{format_count(shares[1])}"
        )
        if models:
            rows = [format_predictor(predictor) for predictor in compare_predictors(judgements)]
            blocks.append(format_table(PREDICTORS, rows))
            blocks.extend(list_errors(judgements))
    methods = compare_methods(judgements)
    if len(methods) > 1:
        blocks.append(format_table(METHODS, [format_method(method) for method in methods]))
    if responses:
        blocks.append(format_table(DOSES, [format_dose(response) for response in responses]))
    return "\n\n".join(blocks)


def list_target_rows(judgements: Sequence[Judgement]) -> list[Row]:
    """Return one row a target, as headed by TARGETS."""
    return [
        (target.what, target.result, target.beside, target.target, ANSWERS[target.met])
        for target in check_targets(judgements)
    ]


def format_modelled(judgement: Judgement, models: Sequence[str] = ()) -> Row:
    """Return a trial with unlisted physics as headed by MODELLED, and floors of rivals' models."""
    seal, answer = judgement.trial.seal, judgement.answer
    return (
        ", ".join(effect.name for effect in seal.unlisted),
        ", ".join(effect.place for effect in seal.unlisted),
        answer.place or NOTHING,
        ", ".join(answer.named) or (RANDOM if answer.random else NOTHING),
        NOTHING if judgement.modelled is None else format_number(judgement.modelled, 3),
        *(format_floors(judgement, name) for name in models),
    )


def format_floors(judgement: Judgement, name: str) -> str:
    """Return what a rival's model reached on the other recording of a trial."""
    model = judgement.models.get(name)
    if model is None or (model.floors is None and not model.error):
        return NOTHING
    return "error" if model.floors is None else format_number(model.floors, 3)


def format_predictor(predictor: Predictor) -> Row:
    """Return a model as headed by PREDICTORS; seconds are the median for 60 s of recording."""
    floors, seconds = predictor.quantiles, predictor.cpu_seconds
    numbers = (
        NOTHING if value is None else format_number(value, 3)
        for value in (floors.median, floors.high, seconds.median)
    )
    return (predictor.name, *map(format_count, predictor.within), *numbers)


def format_method(method: Method) -> Row:
    """Return one method as headed by METHODS; seconds are the median for 60 s of recording."""
    shares = (
        *(method.right[kind] for kind in LISTED_KINDS),
        method.false_alarms,
        method.misnamed,
        method.wrong,
        method.abstained,
    )
    counts = (format_count(share) for share in shares)
    return (method.name, *counts, format_number(method.seconds.median, 3))


def format_count(share: Share) -> str:
    """Return "3 of 4"; a dash when nothing was tried."""
    return f"{share.hits} of {share.tries}" if share.tries else NOTHING


def format_dose(response: Response) -> Row:
    """Return one effect as headed by DOSES."""
    down_to = f"times {response.doses[-1].factor:g}" if response.doses else NOTHING
    least = response.least
    if least is None:
        return (response.effect, "not found", NOTHING, NOTHING, down_to)
    size = f"{format_number(least.size, 3)} {least.unit}".strip().removesuffix(" 1")
    tries = format_share(least.named)[0]
    return (response.effect, size, format_number(least.half_widths, 3), tries, down_to)
