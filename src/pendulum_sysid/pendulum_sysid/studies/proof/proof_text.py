"""The proof as a few lines of text."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.dose_response import Response
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.targets import check_targets, format_share
from pendulum_sysid.telling.tables import NOTHING, Row, number, table

ANSWERS = {True: "yes", False: "no", None: NOTHING}


def format_proof(judged: Sequence[Judgement], responses: Sequence[Response]) -> str:
    """Return the marks, the methods side by side when there are rivals, and the dose-response when it was asked for."""
    blocks = [
        table(
            ("what", "found", "95 % interval or others", "mark", "met"), list_target_rows(judged)
        )
    ]
    found = statistics.compare_methods(judged)
    if len(found) > 1:
        blocks.append(table(METHODS, [format_method(one) for one in found]))
    if responses:
        blocks.append(table(DOSES, [format_dose(one) for one in responses]))
    return "\n\n".join(blocks)


def list_target_rows(judged: Sequence[Judgement]) -> list[Row]:
    """Return one row a mark."""
    return [
        (one.what, one.found, one.beside, one.mark, ANSWERS[one.met])
        for one in check_targets(judged)
    ]


METHODS: Row = (
    "method",
    "single",
    "pair",
    "triple",
    "false alarms",
    "unlisted misnamed",
    "wrong in all",
    "abstained",
    "s",
)


def format_method(one: statistics.Method) -> Row:
    """Return one method as headed by METHODS; seconds are the median for 60 s of recording."""
    listed = [one.right[kind] for kind in ("single", "pair", "triple")]
    shares = (*listed, one.false_alarms, one.misnamed, one.wrong, one.abstained)
    return (one.name, *(format_count(each) for each in shares), number(one.seconds.median, 3))


def format_count(found: Share) -> str:
    """Return "3 of 4"; a dash when nothing was tried."""
    return f"{found.hits} of {found.tries}" if found.tries else NOTHING


DOSES: Row = ("effect", "smallest size found", "in half widths", "tries there", "asked down to")


def format_dose(one: Response) -> Row:
    """Return one effect as headed by DOSES."""
    asked = f"times {one.doses[-1].factor:g}" if one.doses else NOTHING
    if one.least is None:
        return (one.effect, "not found", NOTHING, NOTHING, asked)
    size = f"{number(one.least.size, 3)} {one.least.unit}".strip().removesuffix(" 1")
    return (
        one.effect,
        size,
        number(one.least.half_widths, 3),
        format_share(one.least.found)[0],
        asked,
    )
