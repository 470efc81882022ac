"""The proof as lines of text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid.studies.proof.dose_response import Response
from pendulum_sysid.studies.proof.records import Judgement
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
DOSES: Row = ("effect", "smallest size found", "in half widths", "tries there", "tried down to")


def format_proof(judgements: Sequence[Judgement], responses: Sequence[Response]) -> str:
    """Return the targets, the methods when there are rivals, and the doses when there are any."""
    blocks = [format_table(TARGETS, list_target_rows(judgements))]
    unlisted = [judgement for judgement in judgements if judgement.trial.seal.unlisted]
    if unlisted:
        blocks.append(format_table(MODELLED, [format_modelled(each) for each in unlisted]))
        shares = [count_modelled(judgements, most) for most in (1.5, 3.0)]
        blocks.append(
            f"modelled within 1.5 floors: {format_count(shares[0])}; within 3: "
            f"{format_count(shares[1])}"
        )
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


def format_modelled(judgement: Judgement) -> Row:
    """Return one trial with unlisted physics as headed by MODELLED."""
    seal, answer = judgement.trial.seal, judgement.answer
    return (
        ", ".join(effect.name for effect in seal.unlisted),
        ", ".join(effect.place for effect in seal.unlisted),
        answer.place or NOTHING,
        ", ".join(answer.named) or NOTHING,
        NOTHING if judgement.modelled is None else format_number(judgement.modelled, 3),
    )


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
