"""The proof as JSON: every figure, and every trial behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.dose_response import Dose, Response
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.records import Judgement, NamesJudgement, Size
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.targets import check_targets

SCHEMA = "pendulum_proof/1"


def make_proof_mapping(
    plan: Plan, judged: Sequence[Judgement], responses: Sequence[Response], elapsed_s: float
) -> dict:
    """Return the proof in JSON's types."""
    matrix = statistics.count_confusion(judged)
    return {
        "schema": SCHEMA,
        "plan": asdict(plan),
        "marks": [{**asdict(one), "share": _share(one.share)} for one in check_targets(judged)],
        "methods": [_method(one) for one in statistics.compare_methods(judged)],
        "confusion": [
            {
                "concealed": row,
                "named": column,
                "count": count,
                "tied": matrix.tied.get((row, column), 0),
            }
            for (row, column), count in sorted(matrix.counts.items())
        ],
        "coverage": {
            "sizes": _share(statistics.compute_coverage(statistics.collect_sizes(judged))),
            "shapes": _share(
                statistics.compute_coverage(statistics.collect_sizes(judged, shape=True))
            ),
            "rig": _share(statistics.compute_coverage(statistics.collect_rig_constants(judged))),
        },
        "dose_response": [
            {
                "effect": one.effect,
                "doses": [_dose(dose) for dose in one.doses],
                "least": None if one.least is None else _dose(one.least),
            }
            for one in responses
        ],
        "trials": [_trial(one) for one in judged],
        "elapsed_s": elapsed_s,
    }


def _share(one: Share | None) -> dict | None:
    return None if one is None else one.to_mapping()


def _method(one: statistics.Method) -> dict[str, Any]:
    shares = {
        key: _share(getattr(one, key))
        for key in ("false_alarms", "misnamed", "wrong", "abstained")
    }
    right = {kind: _share(found) for kind, found in one.right.items()}
    return {"name": one.name, "right": right, **shares, "seconds": asdict(one.seconds)}


def _dose(one: Dose) -> dict[str, Any]:
    return {**asdict(one), "found": _share(one.found)}


def _trial(one: Judgement) -> dict[str, Any]:
    sealed = one.sealed
    about = (
        "kind",
        "seed",
        "pole_counts",
        "seconds",
        "closed_loop",
        "size_factor",
        "effects",
        "rig",
    )
    return {
        "name": sealed.name,
        **{key: getattr(sealed, key) for key in about},
        "unlisted": [asdict(each) for each in sealed.unlisted],
        "answer": asdict(one.answer),
        "judged": _names(one.names),
        "sizes": [_size(each) for each in (*one.sizes, *one.rig)],
        "told_sizes": [_size(each) for each in one.told],
        "held_out": {**asdict(one.held_out), "ratio": one.held_out.ratio},
        "diagnosis_seconds": one.seconds,
        "diagnosis_cpu_seconds": one.cpu_seconds,
        "rivals": {
            name: {"named": rival.named, "judged": _names(rival.names), "seconds": rival.seconds}
            for name, rival in one.rivals.items()
        },
    }


def _names(one: NamesJudgement) -> dict[str, Any]:
    return {**asdict(one), "how": one.how.value}


def _size(one: Size) -> dict[str, Any]:
    return {**asdict(one), "relative_error": one.error, "inside": one.inside}
